"""report_data: what a scan's report says, for programs."""

from dataclasses import asdict
from typing import Any

import numpy as np

from capture_app.commands.scan import ScanRequest
from ingest.scan.clean_mesh import CleanMesh
from ingest.scan.scan_quality import ScanReport
from ingest.scan.scanned_object import ScannedObject


def report_data(
    request: ScanRequest,
    cleaned: CleanMesh,
    report: ScanReport,
    found: ScannedObject | None,
    seconds: dict[str, float],
) -> dict[str, Any]:
    """Checks, sizes and numbers, of JSON's types alone; metres, seconds, degrees."""
    mesh = cleaned.mesh
    return {
        "source": str(request.source),
        "mesh": request.output.name,
        "severity": report.severity,
        "usable": report.usable,
        "checks": [asdict(check) for check in report.checks],
        "object": {
            "extents": _numbers(np.ptp(mesh.vertices, axis=0)),
            "vertices": len(mesh.vertices),
            "faces": len(mesh.faces),
            "watertight": cleaned.watertight,
            "seen": round(float(cleaned.seen.mean()), 3),
        },
        "seconds": seconds,
        **({} if found is None else _of_film(found, report)),
    }


def _of_film(found: ScannedObject, report: ScanReport) -> dict[str, Any]:
    registered, coverage = found.registered, report.coverage
    low, high = _box(found)
    return {
        "method": found.method,
        "voxel": round(found.voxel, 5),
        "pictures": {
            "given": found.frames.seen,
            "picked": len(found.frames.frames),
            "registered": len(registered.views),
            "left_out": {one.name: one.reason for one in registered.left_out},
        },
        "reprojection": round(registered.reprojection, 3),
        "scale": {
            **asdict(registered.scale),
            **({"sigma": None} if report.cut_off else {}),
            "up": registered.up,
        },
        "box": {"low": _numbers(low), "high": _numbers(high)},
        "T_world_object": [_numbers(row, 6) for row in found.cleaned.T_world_object],
        "coverage": None
        if coverage is None
        else {
            "azimuth": _numbers(coverage.azimuth, 1),
            "elevation": _numbers(coverage.elevation, 1),
            "gap": list(coverage.gap),
        },
    }


def _box(found: ScannedObject) -> tuple[np.ndarray, np.ndarray]:
    """What the option for a box takes: corners in the world that the stages work in."""
    region = found.region
    pick = np.indices((2, 2, 2)).reshape(3, -1).T
    T = region.T_world_floor
    corners = np.where(pick, region.high, region.low) @ T[:3, :3].T + T[:3, 3]
    return corners.min(axis=0) / found.stretched, corners.max(axis=0) / found.stretched


def _numbers(values: np.ndarray, digits: int = 4) -> list[float]:
    return [round(float(value), digits) for value in values]
