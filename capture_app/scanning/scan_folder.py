"""The folder beside a scan's mesh, and how long a scan will take."""

import os
import shutil

from capture_app.commands.scan import ScanRequest
from ingest.report.take_inspection import REPORT_DATA, REPORT_PAGE
from ingest.scan.clean_mesh import FORMATS
from ingest.scan.scan_choices import DRAFT_PICTURES
from omomo_core.errors import InputError
from omomo_core.whole_file import check_target, write_whole

MARK = "scan.txt"
MODEL, IMAGES = "model", "images"
VIEWS, OUTLINE = "views.png", "outline.png"
_KEPT = frozenset((MARK, MODEL, IMAGES, REPORT_PAGE, REPORT_DATA, VIEWS, OUTLINE))
_ABOUT = """What omocap scan made beside {name}.

report.html   how good the scan is, and what to film again
model, images COLMAP model in the mesh's own frame, for omocap calibrate scan
The rest is what a scan goes on from when it is interrupted or asked for again; it may be deleted.
"""


def open_folder(request: ScanRequest) -> None:
    """Make the folder, or find it as an earlier scan left it.

    Raises:
        InputError: "output-exists", "scan-folder" (it holds something else), or those of
            `check_target`.
    """
    check_target(request.output, FORMATS)
    if request.output.exists() and not request.replace:
        raise InputError(
            "output-exists",
            "There is a mesh of that name already.",
            where=str(request.output),
            fix="Give another name with ‹output›, or replace it with ‹replace›.",
        )
    work = request.work
    if work.exists() and not (work / MARK).is_file() and (work.is_file() or any(work.iterdir())):
        raise InputError(
            "scan-folder",
            "The folder that a scan keeps beside its mesh holds something else.",
            where=str(work),
            fix="Give the mesh another name with ‹output›.",
        )
    work.mkdir(exist_ok=True)
    write_whole(work / MARK, _ABOUT.format(name=request.output.name))


def tidy(request: ScanRequest) -> None:
    """Delete what only another run of the same scan would need."""
    for inside in request.work.iterdir():
        if inside.name in _KEPT:
            continue
        if inside.is_dir():
            shutil.rmtree(inside)
        else:
            inside.unlink()


def forget_empty(request: ScanRequest) -> None:
    """Delete the folder again where a scan that failed has left nothing to go on from."""
    if [inside.name for inside in request.work.iterdir()] == [MARK]:
        shutil.rmtree(request.work)


_START = 50.0
"""Time of a scan in which only one core works, seconds (docs/scan.md has what was measured)."""
_PICTURE = 3.0
"""Time of all cores together for each picture of a scan, seconds."""
_DRAFT_START = 20.0
"""Time of a draft in which only one core works, seconds."""
_DRAFT = 2.2
"""Time of all cores together for each picture of a draft, seconds."""
_CORES = 4
"""More do not help much."""


def estimate_seconds(frames: int, draft: bool) -> float:
    """Seconds that a film takes on this machine when nothing else runs on it.

    Args:
        frames: pictures that it may use.
        draft: whether only a coarse mesh is made.
    """
    cores = min(_CORES, os.cpu_count() or 1)
    if draft:
        return _DRAFT_START + _DRAFT * min(frames, DRAFT_PICTURES) / cores
    return _START + _PICTURE * frames / cores


def in_words(seconds: float) -> str:
    """A length of time for people."""
    return (
        f"{10 * max(1, round(seconds / 10))} s" if seconds < 100 else f"{round(seconds / 60)} min"
    )
