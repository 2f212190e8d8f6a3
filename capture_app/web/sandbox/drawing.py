"""Pictures that are drawn in the sandbox: posters, and boards to print.

The server names these functions and never calls them, so what draws is loaded in the children alone.
"""

from pathlib import Path
from typing import Any

from omomo_core.whole_file import whole_file


def draw_object(mesh: Path, scale: float, poster: Path) -> dict[str, Any]:
    """Of an object.

    Raises:
        InputError: as `load_mesh`.
    """
    from capture_app.posters import object_poster
    from ingest.mesh import load_mesh

    object_poster(poster, load_mesh(mesh, scale=scale))
    return {}


def draw_mount(mount: Path, mesh: Path, scale: float, poster: Path) -> dict[str, Any]:
    """Of a phone on its object.

    Raises:
        InputError: as `load_mount` and `load_mesh`.
    """
    from capture_app.posters import mount_poster
    from ingest.mesh import load_mesh
    from ingest.mount_file import load_mount

    known = load_mount(mount)
    mount_poster(poster, known, load_mesh(mesh, scale=scale * known.object_scale))
    return {}


def draw_result(result: Path, poster: Path) -> dict[str, Any]:
    """Of a result.

    Raises:
        InputError: as `load_result`.
    """
    from capture_app.posters import result_poster
    from capture_app.result import load_result

    result_poster(poster, load_result(result))
    return {}


def board_sheet(paper: str, target: Path) -> dict[str, Any]:
    """Write the PDF of the board that fills a sheet of this paper.

    Raises:
        InputError: "paper-unknown".
    """
    from ingest.calibration.board.board_sheet import preset_for, write_sheet

    with whole_file(target) as partial:
        write_sheet(preset_for(paper), paper, partial)
    return {}
