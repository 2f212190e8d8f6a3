"""write_report: page, data and pictures of a scan into the folder beside its mesh."""

import json

import numpy as np
from jaxtyping import UInt8

from capture_app.commands.scan import ScanRequest
from capture_app.scanning.data import report_data
from capture_app.scanning.folder import OUTLINE, VIEWS
from capture_app.scanning.page import scan_page
from capture_app.scanning.pictures import outline_picture, views_picture
from ingest.report.scanned import REPORT_DATA, REPORT_PAGE
from ingest.scan.clean.clean import CleanMesh
from ingest.scan.found import Found
from ingest.scan.quality.report import ScanReport
from omomo_core.whole_file import write_whole
from render.stills import write_png

_SIDES = "The mesh from four sides: in its colours, and its shape alone."
_RIMS = "Two of the pictures: orange is the mesh's outline, blue the box that it was looked for in."


def write_report(
    request: ScanRequest,
    cleaned: CleanMesh,
    report: ScanReport,
    found: Found | None,
    seconds: dict[str, float],
) -> None:
    """Write everything that says how good a scan is.

    Raises:
        InputError: those of `whole_file`.
    """
    work = request.work
    pictures: dict[str, UInt8[np.ndarray, "h w 3"]] = {_SIDES: views_picture(cleaned)}
    write_png(work / VIEWS, pictures[_SIDES])
    if found is not None and (outlined := outline_picture(found)) is not None:
        pictures[_RIMS] = outlined
        write_png(work / OUTLINE, outlined)
    data = report_data(request, cleaned, report, found, seconds)
    write_whole(work / REPORT_DATA, json.dumps(data, indent=1) + "\n")
    write_whole(work / REPORT_PAGE, scan_page(request, cleaned, report, found, pictures))
