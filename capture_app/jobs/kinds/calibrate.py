"""Recordings become a mount."""

from pathlib import Path
from typing import Any

from capture_app.commands.calibrate.request import CalibrateRequest
from capture_app.jobs.kinds.thing import ThingWork
from capture_app.jobs.work import Attempt, Kind
from capture_app.progress import Progress
from capture_app.things import FILES, PICTURE


def _start(order: CalibrateRequest, attempt: Attempt) -> ThingWork:
    from capture_app.calibration.calibrate import calibrate
    from capture_app.facts import mount_facts
    from capture_app.posters import mount_poster

    def make(folder: Path, progress: Progress) -> dict[str, Any]:
        path = folder / FILES / "mount.json"
        progress("calibrate", 0.0)
        mount = calibrate(order.way, path, progress, picture=None)
        if (solid := order.way.solid) is not None:
            mount_poster(folder / PICTURE, mount, solid.load(mount.object_scale))
        progress("calibrate", 1.0)
        return mount_facts(path)

    return ThingWork(order, attempt, make)


KIND = Kind(CalibrateRequest, _start, {"board": 0.7, "localise": 0.7, "calibrate": 0.3})
