"""Jobs that make an item of the library: a scan makes an object, a calibration a mount."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from capture_app.commands.calibrate.request import CalibrateRequest
from capture_app.commands.request import ItemRequest
from capture_app.commands.scan import ScanRequest
from capture_app.jobs.protocol import Attempt, JobKind
from capture_app.library_item import FILES, INFO, PICTURE, info_of, save_info
from capture_app.progress import Progress, StageClock
from capture_app.staging import Staging

Make = Callable[[Path, Progress], dict[str, Any]]
"""Given the folder of the thing, whose `files` are there, fills it; returns facts about it."""


class ItemJob:
    """A thing in the making; what an earlier attempt left in its folder may be gone on with."""

    def __init__(self, order: ItemRequest, attempt: Attempt, make: Make) -> None:
        """Nothing is read yet."""
        self._order, self._attempt, self._fill = order, attempt, make
        self._staging = Staging(order.output, key=attempt.id)
        self._clock = StageClock(attempt.progress, attempt.timings)

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """Make it, put it in its place."""
        return {"make": self._make, "finish": self._staging.publish}

    @property
    def timings(self) -> Mapping[str, float]:
        """By stage of the progress."""
        return self._clock.seconds

    def settle(self) -> None:
        """Flush the folder; it is flushed already when it has its name."""
        if self._staging.folder.exists():
            self._staging.flush()

    def discard(self) -> None:
        """Remove the folder."""
        self._staging.discard()

    def _make(self) -> None:
        folder = self._staging.open()
        (folder / FILES).mkdir(exist_ok=True)
        facts = {**self._order.facts, **self._fill(folder, self._clock)}
        save_info(folder / INFO, info_of(self._order.name, folder / FILES, facts))
        self._attempt.tell(facts)


MESH = "object.glb"
_SCAN_SHARES = {
    "look": 0.03,
    "frames": 0.05,
    "features": 0.1,
    "compare": 0.05,
    "match": 0.1,
    "cameras": 0.15,
    "stereo": 0.25,
    "silhouettes": 0.05,
    "fusion": 0.1,
    "colours": 0.04,
    "clean": 0.04,
    "texture": 0.04,
    "report": 0.04,
}


def _start_scan(order: ScanRequest, attempt: Attempt) -> ItemJob:
    from capture_app.posters import object_poster
    from capture_app.scanning.scan import scan_object
    from capture_app.summaries import mesh_summary
    from ingest.mesh import load_mesh
    from ingest.report.inspect import REPORT_DATA

    def make(folder: Path, progress: Progress) -> dict[str, Any]:
        # What an earlier attempt wrote is not in the way of this one.
        update = {"output": folder / FILES / MESH, "keep": False, "replace": True}
        request = order.model_copy(update=update)
        scan_object(request, progress)
        object_poster(folder / PICTURE, load_mesh(request.output))
        report = json.loads((request.work / REPORT_DATA).read_text(encoding="utf-8"))
        return {
            "mesh": MESH,
            **mesh_summary(request.output, 1.0),
            "scan": {"severity": report["severity"], "checks": report["checks"]},
        }

    return ItemJob(order, attempt, make)


SCAN = JobKind(ScanRequest, _start_scan, _SCAN_SHARES)


def _start_calibrate(order: CalibrateRequest, attempt: Attempt) -> ItemJob:
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


CALIBRATE = JobKind(
    CalibrateRequest, _start_calibrate, {"board": 0.7, "localise": 0.7, "calibrate": 0.3}
)
