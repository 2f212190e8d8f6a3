"""What every calibration ends with: the mount file, and what it says in millimetres and degrees."""

import itertools
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rich.markup import escape
from scipy.spatial.transform import Rotation

from capture_app.calibration.mount_words import fit_sentence, mount_words
from capture_app.cli.console import output, say
from capture_app.commands.calibrate import Way
from capture_app.commands.inputs import MeshFile
from capture_app.commands.request import validated
from ingest.mount import Mount
from ingest.uncertainty import bounds_95
from omomo_core.errors import InputError


def check_output(path: Path) -> None:
    """Refuse a place for the mount file and its picture where something is, before any work.

    Raises:
        InputError: "output-exists" or "output-folder".
    """
    check_free(path)
    check_free(_picture(path))


def check_free(path: Path) -> None:
    """Refuse a place for a file where something is, or whose folder is not there.

    Raises:
        InputError: "output-exists" or "output-folder".
    """
    if path.exists():
        raise InputError(
            "output-exists",
            f"There is already a {'folder' if path.is_dir() else 'file'} of that name.",
            where=str(path),
            fix="Name another file with -o: a calibration is never overwritten.",
        )
    if not path.absolute().parent.is_dir():
        raise InputError(
            "output-folder",
            "The folder for the file is not there.",
            where=str(path.parent),
            fix="Make it, or name another place with -o.",
        )


def carry_out(model: type[Way], said: Mapping[str, Any], path: Path) -> None:
    """Find a mount by a recorded way, write it and print what was found.

    Args:
        model: of the way.
        said: values of its fields as they were typed.
        path: of the mount file.

    Raises:
        InputError: see `validated`, `check_output` and `capture_app.calibration.calibrate`.
    """
    from capture_app.calibration.calibrate import calibrate
    from capture_app.cli.console import progress_bars

    way: Any = validated(model, said, "option-invalid")
    check_output(path)
    with progress_bars() as progress:
        mount = calibrate(way, path, progress, picture=_picture(path))
    _print_mount(mount, path)


def finish(mount: Mount, path: Path, mesh_file: MeshFile | None = None, phone: str = "") -> None:
    """Write the mount file and print what was found, how sure it is and what stayed open.

    Args:
        mount: the calibration; its date is set to today.
        path: of mount.json, as `check_output` allows.
        mesh_file: the object it is for, when it is known; then both are drawn.
        phone: its model, when it is known.
    """
    from capture_app.calibration.calibrate import write_mount

    _print_mount(write_mount(mount, path, mesh_file, phone, picture=_picture(path)), path)


def mesh_file_of(mesh: Path | None) -> MeshFile | None:
    """The object of --object."""
    return None if mesh is None else MeshFile(mesh)


def _picture(path: Path) -> Path:
    return path.with_suffix(".png")


def _print_mount(mount: Mount, path: Path) -> None:
    show(mount)
    beside = f" and its picture, {mount.picture}" if mount.picture else ""
    output.print(f"Written: {escape(str(path))}{beside}", soft_wrap=True)


def show(mount: Mount) -> None:
    """Print a mount as a person reads it."""
    say("Mount", _place(mount), "bold")
    bounds = None if mount.covariance is None else bounds_95(mount.covariance)
    words = mount_words(mount.method, bounds, mount.residuals)
    if bounds is None:
        say("Sure to", "nobody can tell: its method states no uncertainty", "bold yellow")
    else:
        colour = "yellow" if words["warnings"] else "green"
        say("Sure to", f"{bounds.mm:.1f} mm and {bounds.deg:.2f} deg (95 %)", f"bold {colour}")
    for sentence in filter(None, itertools.starmap(fit_sentence, mount.residuals.items())):
        say("Fit", sentence, "bold")
    for warning in words["warnings"]:
        say("Note", warning, "bold yellow")
    for free in mount.free:
        say("Not seen", free, "bold yellow")
    if mount.note:
        say("Note", mount.note, "bold yellow")


def _place(mount: Mount) -> str:
    """Return the method in words, and the place of the object's origin as the phone sees it."""
    x, y, z = 1e3 * mount.T_phone_object[:3, 3]
    angle = np.degrees(Rotation.from_matrix(mount.T_phone_object[:3, :3]).magnitude())
    return (
        f"{mount.method}; the object's origin is {x:+.1f} mm right, {y:+.1f} up, {-z:+.1f} ahead "
        f"of the camera (phone held sideways), turned {angle:.1f} deg"
    )
