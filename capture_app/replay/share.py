"""From a path that a user names to a scene, and to one HTML file that anybody can open."""

import gzip
import re
from base64 import b64encode
from collections.abc import Sequence
from hashlib import sha256
from html import escape
from pathlib import Path

from capture_app.inspection import inspect_take
from capture_app.manifest import MOTION
from capture_app.progress import Progress, silent
from capture_app.replay import VIEWER
from capture_app.replay.scene_pack import pack_result, pack_session
from capture_app.result import load_result
from capture_app.solve_samples import all_solved
from ingest.trajectory.trajectory_config import AS_LOGGED, Reading
from omomo_core.errors import InputError

_START = "replay.js"
_IMPORT = re.compile(r'^import (?:\* as (\w+)|(\{[^}]*\})) from "\./([\w.]+)";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export ((?:async )?function|class|const) (\w+)", re.MULTILINE)
_STYLE = re.compile(r'<link rel="stylesheet" href="([\w.]+)">\n')
_SCRIPT = f'<script type="module" src="{_START}"></script>\n'


def share_page(packs: Sequence[bytes], title: str) -> str:
    """The replay page with its scripts and styles, and with scenes in it.

    Args:
        packs: one scene pack, or several to be compared.
        title: of the page, until its script knows better.
    """
    page = (VIEWER / "replay.html").read_text(encoding="utf-8")
    styles = "".join(_read(name) for name in _STYLE.findall(page))
    script = bundle(_START)
    page = _STYLE.sub("", page)
    page = page.replace("<title>Replay</title>", f"<title>{escape(title)}</title>")
    head = f'<meta http-equiv="Content-Security-Policy" content="{_policy(script, styles)}">\n'
    page = page.replace('<meta charset="utf-8">\n', f'<meta charset="utf-8">\n{head}')
    page = page.replace("</head>", f"<style>{styles}</style>\n</head>")
    scenes = "".join(_scene(pack) for pack in packs)
    return page.replace(_SCRIPT, f'{scenes}<script type="module">{script}</script>\n')


def bundle(start: str) -> str:
    """A module and all that it imports as one script.

    Each module becomes a function that returns what it exports, called once, after those that it
    imports. Modules import by `import {a, b} from "./x.js"` or `import * as x from "./x.js"`.
    """
    done: dict[str, str] = {}
    _gather(start, done)
    return "".join(done.values())


def _gather(name: str, done: dict[str, str]) -> None:
    text = _read(name)
    for statement in _IMPORT.finditer(text):
        if statement[3] not in done:
            _gather(statement[3], done)
    text = _IMPORT.sub(lambda m: f"const {m[1] or m[2]} = {_place(m[3])};\n", text)
    exports = ", ".join(name for _, name in _EXPORT.findall(text))
    text = _EXPORT.sub(r"\1 \2", text)
    done[name] = f"const {_place(name)} = (() => {{\n{text}\nreturn {{ {exports} }};\n}})();\n"


def _place(module: str) -> str:
    return f"module_{Path(module).stem}"


def _read(name: str) -> str:
    return (VIEWER / name).read_text(encoding="utf-8")


def _scene(pack: bytes) -> str:
    packed = b64encode(gzip.compress(pack, mtime=0)).decode()
    return f'<script type="text/plain" data-scene>{packed}</script>\n'


def _policy(script: str, styles: str) -> str:
    """Nothing but what is in the file; style attributes that scripts set are not ruled by it."""
    allowed = {"script": script, "style": styles}
    sources = [f"{kind}-src '{_digest(text)}'" for kind, text in allowed.items()]
    return "; ".join(["default-src 'none'", *sources, "img-src blob:", "base-uri 'none'"])


def _digest(text: str) -> str:
    return f"sha256-{b64encode(sha256(text.encode()).digest()).decode()}"


def is_result(path: Path) -> bool:
    """Whether this is a result folder, and not what a phone logged."""
    return (path / MOTION).is_file()


def open_scene(
    path: Path,
    mesh: Path | None,
    mount: Path | None,
    mesh_scale: float,
    *,
    film: bool,
    reading: Reading = AS_LOGGED,
    progress: Progress = silent,
) -> bytes:
    """The scene pack of a result folder or a session.

    Args:
        path: a result folder, or what a phone's logger wrote.
        mesh, mount, mesh_scale: the object of a session; a result has its own.
        film: show what the phone filmed, too.
        reading: what is said about a session that its log does not say.
        progress: told the stage "solve" where samples were not solved yet.

    Raises:
        InputError: it is neither, or "object-unused".
    """
    if not is_result(path):
        inspection = inspect_take(path, mesh, mount, reading=reading, mesh_scale=mesh_scale)
        return pack_session(inspection, film=film)
    if mesh is not None:
        raise InputError(
            "object-unused",
            "A result has its object in it.",
            where=str(path),
            fix="Leave out ‹object› and ‹mount›.",
        )
    return pack_result(all_solved(load_result(path), progress), film=film)
