"""A film of an object becomes the object."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from capture_app.jobs.kinds.thing import ThingWork
from capture_app.jobs.orders import ScanOrder
from capture_app.jobs.work import Attempt, Kind
from capture_app.progress import Progress
from capture_app.things import FILES, PICTURE

if TYPE_CHECKING:
    from capture_app.scanning.request import ScanRequest

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


def _start(order: ScanOrder, attempt: Attempt) -> ThingWork:
    from capture_app.facts import mesh_facts
    from capture_app.posters import object_poster
    from capture_app.scanning.scan import scan_object
    from ingest.mesh import load_mesh
    from ingest.report.scanned import REPORT_DATA

    def make(folder: Path, progress: Progress) -> dict[str, Any]:
        request = _request(order, folder / FILES / MESH)
        scan_object(request, progress)
        object_poster(folder / PICTURE, load_mesh(request.output))
        report = json.loads((request.work / REPORT_DATA).read_text(encoding="utf-8"))
        return {
            "mesh": MESH,
            **mesh_facts(request.output, 1.0),
            "scan": {"severity": report["severity"], "checks": report["checks"]},
        }

    return ThingWork(order, attempt, make)


def _request(order: ScanOrder, output: Path) -> "ScanRequest":
    import numpy as np

    from capture_app.scanning.request import ScanRequest
    from ingest.calibration.board.spec import parse_board
    from ingest.scan.cameras.options import CameraOptions
    from ingest.scan.region.region import GivenBox

    corners = None if order.box is None else np.array(order.box).reshape(2, 3)
    return ScanRequest(
        source=order.source,
        output=output,
        images=order.images,
        format=order.format,
        frames=order.frames,
        cameras=CameraOptions(
            poses=order.poses,
            axes=order.camera_axes,
            board=None if order.board is None else parse_board(order.board),
            height=order.height,
            metric=order.metric,
        ),
        box=None if corners is None else GivenBox(corners.min(axis=0), corners.max(axis=0)),
        method=order.method,
        vertices=order.vertices,
        unit=order.unit,
        object_name=order.object_name,
        keep=False,
        # What an earlier attempt wrote is not in the way of this one.
        replace=True,
    )


KIND = Kind(ScanOrder, _start, _SHARES)
