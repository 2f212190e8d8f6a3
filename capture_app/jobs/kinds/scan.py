"""A film of an object becomes the object."""

import json
from pathlib import Path
from typing import Any

from capture_app.commands.scan import ScanRequest
from capture_app.jobs.kinds.library_item import ItemJob
from capture_app.jobs.protocol import Attempt, JobKind
from capture_app.library_item import FILES, PICTURE
from capture_app.progress import Progress

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


def _start(order: ScanRequest, attempt: Attempt) -> ItemJob:
    from capture_app.posters import object_poster
    from capture_app.scanning.scan import scan_object
    from capture_app.summaries import mesh_summary
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
            **mesh_summary(request.output, 1.0),
            "scan": {"severity": report["severity"], "checks": report["checks"]},
        }

    return ItemJob(order, attempt, make)


KIND = JobKind(ScanRequest, _start, _SHARES)
