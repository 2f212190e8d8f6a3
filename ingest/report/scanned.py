"""Where the report of a scan lies, and what it says against using the mesh."""

from pathlib import Path

from pydantic import BaseModel, ValidationError

from ingest.report.check import Check

REPORT_PAGE, REPORT_DATA = "report.html", "report.json"
_MOST_BYTES = 1_000_000


class _ScanCheck(BaseModel):
    name: str
    severity: str


class _ScanVerdict(BaseModel):
    mesh: str
    usable: bool
    checks: tuple[_ScanCheck, ...]


def work_folder(mesh: Path) -> Path:
    """Return the folder beside a mesh that `omocap scan` keeps: report, pictures, model, stages."""
    return mesh.with_suffix(".scan")


def scan_checks(mesh: Path) -> tuple[Check, ...]:
    """Return one red check where `omocap scan` called this mesh not usable, else none.

    A mesh without a report of its own beside it, as those of other apps, is not judged.
    """
    report = work_folder(mesh) / REPORT_DATA
    try:
        if report.stat().st_size > _MOST_BYTES:
            return ()
        verdict = _ScanVerdict.model_validate_json(report.read_bytes())
    except (OSError, ValidationError):
        return ()
    if verdict.usable or verdict.mesh != mesh.name:
        return ()
    reasons = ", ".join(check.name for check in verdict.checks if check.severity == "bad")
    return (
        Check(
            "scan",
            "bad",
            f"omocap scan found its mesh {mesh.name} not usable: {reasons}",
            fix=f"Film the object again as {report.with_name(REPORT_PAGE)} says, or give another mesh.",
        ),
    )
