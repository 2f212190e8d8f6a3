"""Recordings become a mount."""

from pathlib import Path
from typing import Any

from capture_app.commands.calibrate.request import CalibrateRequest
from capture_app.jobs.kinds.library_item import ItemJob
from capture_app.jobs.protocol import Attempt, JobKind
from capture_app.library_item import FILES, PICTURE
from capture_app.progress import Progress


def _start(order: CalibrateRequest, attempt: Attempt) -> ItemJob:
    from capture_app.calibration.calibrate import calibrate
    from capture_app.posters import mount_poster
    from capture_app.summaries import mount_summary

    def make(folder: Path, progress: Progress) -> dict[str, Any]:
        path = folder / FILES / "mount.json"
        progress("calibrate", 0.0)
        mount = calibrate(order.way, path, progress, picture=None)
        if (mesh_file := order.way.mesh_file) is not None:
            mount_poster(folder / PICTURE, mount, mesh_file.load(mount.object_scale))
        progress("calibrate", 1.0)
        return mount_summary(path)

    return ItemJob(order, attempt, make)


KIND = JobKind(CalibrateRequest, _start, {"board": 0.7, "localise": 0.7, "calibrate": 0.3})
