"""From a path that a user names to a scene pack."""

from pathlib import Path

from capture_app.inspection import inspect_take
from capture_app.manifest import MOTION
from capture_app.replay.pack import pack_result, pack_session
from capture_app.result import load_result
from ingest.trajectory.trajectory_config import AS_LOGGED, Reading
from omomo_core.errors import InputError


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
) -> bytes:
    """The scene pack of a result folder or a session.

    Args:
        path: a result folder, or what a phone's logger wrote.
        mesh, mount, mesh_scale: the object of a session; a result has its own.
        film: show what the phone filmed, too.
        reading: what is said about a session that its log does not say.

    Raises:
        InputError: it is neither, or "object-unused".
    """
    if not is_result(path):
        seen = inspect_take(path, mesh, mount, reading=reading, mesh_scale=mesh_scale)
        return pack_session(seen, film=film)
    if mesh is not None:
        raise InputError(
            "object-unused",
            "A result has its object in it.",
            where=str(path),
            fix="Leave out --object and --mount.",
        )
    return pack_result(load_result(path), film=film)
