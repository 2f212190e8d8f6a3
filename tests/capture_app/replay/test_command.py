"""`omocap replay`: a file for a result, for a session, for two to compare."""

import base64
import gzip
import re
import webbrowser
from pathlib import Path

import pytest
import typer

from capture_app.cli.replay import replay
from capture_app.manifest import MANIFEST, MOTION, write_manifest
from capture_app.replay import VIEWER
from capture_app.replay.share import bundle, share_page
from capture_app.result import save_motion
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from omomo_core.errors import InputError
from tests.capture_app.replay.made import make_result, read_pack


@pytest.fixture
def result(tmp_path: Path) -> Path:
    folder = tmp_path / "carry"
    folder.mkdir()
    made = make_result(folder)
    save_motion(folder / MOTION, made.people, 0, made.object_motion, "anny")
    write_manifest(folder / MANIFEST, made.manifest)
    return folder


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What the command opens in the browser."""
    places: list[str] = []
    monkeypatch.setattr(webbrowser, "open", places.append)
    return places


def _scenes(page: Path) -> list[dict]:
    held = re.findall(r"data-scene>([^<]*)<", page.read_text(encoding="utf-8"))
    return [read_pack(gzip.decompress(base64.b64decode(text)))[0] for text in held]


def test_result_is_written_beside_its_files_and_opened(result: Path, opened: list[str]) -> None:
    replay(result)
    assert opened == [(result / "replay.html").as_uri()]
    assert [scene["name"] for scene in _scenes(result / "replay.html")] == ["carry"]


def test_two_go_into_the_file_that_is_named(
    result: Path, opened: list[str], tmp_path: Path
) -> None:
    file = tmp_path / "both.html"
    replay(result, DEMO / SESSION, file=file, film=False)
    assert [scene["kind"] for scene in _scenes(file)] == ["result", "session"]
    assert opened == []
    assert not (result / "replay.html").exists()


def test_session_with_its_object_is_written_here(
    opened: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    replay(DEMO / SESSION, mesh=DEMO / MESH, mount=DEMO / MOUNT, browser=False)
    written = tmp_path / "session_replay.html"
    (scene,) = _scenes(written)
    assert scene["object"]["name"] == "box"
    assert scene["film"]["count"] > 20
    assert written.stat().st_size < 2e6
    assert opened == []


def test_what_cannot_be_shown_leaves_no_file(result: Path, tmp_path: Path) -> None:
    file = tmp_path / "x.html"
    for code, act in (
        ("output-ending", lambda: replay(result, file=tmp_path / "x.txt")),
        ("session-missing", lambda: replay(tmp_path / "nothing", file=file)),
        (
            "object-unused",
            lambda: replay(result, mesh=DEMO / MESH, mount=Path("identity"), file=file),
        ),
        ("mount-needed", lambda: replay(DEMO / SESSION, mesh=DEMO / MESH, file=file)),
    ):
        with pytest.raises(InputError) as problem:
            act()
        assert problem.value.code == code
        assert problem.value.fix
    assert not list(tmp_path.glob("*x.*"))


@pytest.mark.runs("replay")
def test_command_line_takes_it(result: Path, tmp_path: Path) -> None:
    app = typer.Typer()
    app.command("replay")(replay)
    with pytest.raises(SystemExit) as done:
        app([str(result), "-o", str(tmp_path / "a.html"), "--no-film"])
    assert done.value.code == 0
    assert (tmp_path / "a.html").is_file()


def test_shared_file_needs_nothing_else() -> None:
    page = share_page([], "A <b> & c")
    assert "<title>A &lt;b&gt; &amp; c</title>" in page
    assert "src=" not in page.split("<script", 1)[0].replace("-src", "")
    assert "stylesheet" not in page
    script = bundle("replay.js")
    assert not re.search(r"^(import|export)\b", script, re.MULTILINE)
    # Characters are shown by the server's page alone.
    used = {path.name for path in VIEWER.glob("*.js")} - {"character.js"}
    assert used == {f"{name}.js" for name in re.findall(r"^const module_(\w+) =", script, re.M)}
