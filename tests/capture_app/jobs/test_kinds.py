"""Each kind of job does what the command of its name does."""

import json
from pathlib import Path

import pytest

from capture_app.commands.export import ExportRequest
from capture_app.commands.render import CompareRequest, RenderRequest
from capture_app.commands.request import Request
from capture_app.commands.run import ResolveRequest
from capture_app.jobs.job_kinds import KINDS, Attempt
from capture_app.manifest import read_manifest
from capture_app.pipeline import run_take


def do(order: Request) -> tuple[list[str], dict[str, object], list[str]]:
    """All stages at once: the stages heard of, the summary, the log."""
    heard: list[str] = []
    told: dict[str, object] = {}
    log: list[str] = []
    kind = KINDS[order.KIND]
    again = kind.order.model_validate(json.loads(order.model_dump_json()))
    assert again == order
    attempt = Attempt("0" * 16, lambda stage, done: heard.append(stage), log.append, told.update)
    work = kind.start(again, attempt)
    for stage in work.stages.values():
        stage()
        work.settle()
    assert set(heard) <= set(kind.shares)
    assert work.timings
    return heard, told, log


@pytest.fixture
def result(inputs, weights: Path) -> Path:
    run_take(inputs.request(weights), lambda stage, done: None)
    return inputs.output


def test_export_render_compare_and_resolve(result: Path, tmp_path: Path) -> None:
    _, told, _ = do(ExportRequest(result=result, to="csv", output=tmp_path / "a.csv"))
    assert told["files"] == ["a.csv"]
    assert (tmp_path / "a.csv").stat().st_size > 1000

    still = RenderRequest(result=result, output=tmp_path / "a.png", size=(64, 64), still=0.5)
    assert "video" in do(still)[0]
    assert (tmp_path / "a.png").stat().st_size > 100

    both = (f"{result}#1", f"{result}#2")
    page = CompareRequest(motions=both, output=tmp_path / "b.png", size=(64, 64), sheet=2)
    assert list(page.inputs.values()) == [result, result]
    do(page)
    assert (tmp_path / "b.png").stat().st_size > 100

    edited = json.loads((result / "contacts.json").read_text())
    edited["segments"] = edited["segments"][1:]
    (tmp_path / "edited.json").write_text(json.dumps(edited))
    order = ResolveRequest(
        result=result, contacts=tmp_path / "edited.json", output=tmp_path / "c", video_size=None
    )
    _, told, log = do(order)
    manifest = read_manifest(tmp_path / "c" / "manifest.json")
    assert manifest.correction is not None
    assert told["scores"] == manifest.scores[0]
    seen = [finding.sentence for finding in manifest.findings]
    assert log == [*seen, *manifest.notes, *manifest.faults]
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]
