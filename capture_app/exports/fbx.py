"""FBX, written and read by a Blender that the user has: the format is closed."""

import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from capture_app.commands.export import Units, UpAxis
from omomo_core.errors import InputError

if TYPE_CHECKING:
    from capture_app.exports.exported_take import Take

_SCRIPT = Path(__file__).with_name("in_blender.py")
_PATIENCE = 900.0
"""Seconds; a minute of motion takes about one."""


def write_fbx(path: Path, take: "Take", up: UpAxis, units: Units, blender: str) -> None:
    """Write a GLB, and have Blender write what it reads there as FBX.

    Args:
        path: the .fbx file to write.
        take: in our own world.
        up: up axis of the file.
        units: of the file.
        blender: from `find_blender`.

    Raises:
        InputError: "blender-failed", with what it said last.
    """
    # The server asks for a Blender at its start, and must not load torch for that.
    from capture_app.exports.glb import write_glb_take

    with TemporaryDirectory(prefix="omocap_fbx_") as folder:
        source = Path(folder, "take.glb")
        write_glb_take(source, take)
        words = [str(source), str(path.resolve()), f"{take.fps:g}", up, units]
        why = _failure(blender, words, path)
    if why is not None:
        raise InputError(
            "blender-failed",
            f"Blender wrote no FBX: {why}",
            where=blender,
            fix="Use Blender 4.2 or later, or export ‹to› glb.",
        )


def read_fbx(path: Path, folder: Path, blender: str) -> Path:
    """Have Blender write a character's FBX as GLB, and return that.

    Args:
        path: the .fbx file.
        folder: for the GLB, which has the FBX's name.
        blender: from `find_blender`.

    Raises:
        InputError: "skeleton-unreadable", with what Blender said last.
    """
    target = folder / f"{path.stem}.glb"
    why = _failure(blender, [str(path.resolve()), str(target)], target)
    if why is not None:
        raise InputError(
            "skeleton-unreadable",
            f"Blender does not read this FBX: {why}",
            where=str(path),
            fix="Give the character as GLB, VRM or BVH, or an FBX of version 7.1 or later.",
        )
    return target


def _failure(blender: str, words: list[str], path: Path) -> str | None:
    """Run the script in Blender; return why it wrote no file, or None."""
    options = ["--background", "--factory-startup", "--python-exit-code", "1"]
    words = [blender, *options, "--python", str(_SCRIPT), "--", *words]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=_PATIENCE, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    if done.returncode or not path.is_file():
        said = (done.stderr or done.stdout).strip().splitlines() or ["it said nothing"]
        return said[-1]
    return None


_BLENDER = "blender"


def has_blender() -> bool:
    """Whether there is a Blender on the PATH."""
    return shutil.which(_BLENDER) is not None


def find_blender(given: str | None) -> str:
    """Blender's executable.

    Args:
        given: its path or name; "blender" on the PATH if None.

    Raises:
        InputError: "blender-missing".
    """
    program = shutil.which(given or _BLENDER)
    if program is None:
        raise InputError(
            "blender-missing",
            "FBX is written and read by Blender, and there is none"
            + (" on the PATH." if given is None else " of this name."),
            where="FBX" if given is None else f"‹blender› {given}",
            fix="Install it from blender.org (4.2 or later) where the command blender is found, or use "
            "GLB, which Unreal, Unity and Blender read and write.",
        )
    return program
