"""Posters of what was not made by a job here."""

from pathlib import Path
from typing import Any

from capture_app.posters import mount_poster, object_poster, result_poster
from capture_app.result import load_result
from ingest.mesh import load_mesh
from ingest.mount_file import load_mount


def draw_object(mesh: Path, scale: float, poster: Path) -> dict[str, Any]:
    """Of an object.

    Raises:
        InputError: as `load_mesh`.
    """
    object_poster(poster, load_mesh(mesh, scale=scale))
    return {}


def draw_mount(mount: Path, mesh: Path, scale: float, poster: Path) -> dict[str, Any]:
    """Of a phone on its object.

    Raises:
        InputError: as `load_mount` and `load_mesh`.
    """
    known = load_mount(mount)
    mount_poster(poster, known, load_mesh(mesh, scale=scale * known.object_scale))
    return {}


def draw_result(result: Path, poster: Path) -> dict[str, Any]:
    """Of a result.

    Raises:
        InputError: as `load_result`.
    """
    result_poster(poster, load_result(result))
    return {}
