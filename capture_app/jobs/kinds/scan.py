"""A film of an object becomes the object."""

import json
from pathlib import Path
from typing import Any

from capture_app.commands.scan import ScanRequest
from capture_app.jobs.kinds.thing import ThingWork
from capture_app.jobs.work import Attempt, Kind
from capture_app.progress import Progress
from capture_app.things import FILES, PICTURE

MESH = "object.glb"
_SHARES = {
    "look": 0.03,
    "frames": 0.05,
    "features": 0.1,
    "compare": 0.05,
    "match": 0.1,
    "cameras": 0.15,
    "stereo": 0.3,
    "fusion": 0.1,
    "colours": 0.04,
    "clean": 0.04,
    "report": 0.04,
}


def _start(order: ScanRequest, attempt: Attempt) -> ThingWork:
    from capture_app.facts import mesh_facts
    from capture_app.posters import object_poster
    from capture_app.scanning.scan import scan_object
    from ingest.mesh import load_mesh
    from ingest.report.scanned import REPORT_DATA

    def make(folder: Path, progress: Progress) -> dict[str, Any]:
        # What an earlier attempt wrote is not in the way of this one.
        update = {"output": folder / FILES / MESH, "keep": False, "replace": True}
        request = order.model_copy(update=update)
        scan_object(request, progress)
        object_poster(folder / PICTURE, load_mesh(request.output))
        report = json.loads((request.work / REPORT_DATA).read_text(encoding="utf-8"))
        return {
            "mesh": MESH,
            **mesh_facts(request.output, 1.0),
            "scan": {"severity": report["severity"], "checks": report["checks"]},
        }

    return ThingWork(order, attempt, make)


KIND = Kind(ScanRequest, _start, _SHARES)
