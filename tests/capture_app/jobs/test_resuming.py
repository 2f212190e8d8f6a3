"""A result that one process began and another one finished is the same, to the last bit."""

from pathlib import Path

import pytest

from capture_app.commands.request import Request
from capture_app.commands.run import RunRequest
from capture_app.jobs.job_kinds import KINDS, Attempt, StagedJob
from capture_app.manifest import CONTACTS, GLB, MOTION
from capture_app.pipeline import run_take
from capture_app.result import load_result

STAGES = ["read", "generate", "export", "finish"]


def begin(
    order: RunRequest, told: dict[str, object], ordered: list[Request] | None = None
) -> StagedJob:
    def follow(more: Request) -> str:
        if ordered is not None:
            ordered.append(more)
        return "1" * 16

    attempt = Attempt(
        "0" * 16, lambda stage, done: None, lambda sentence: None, told.update, follow=follow
    )
    return KINDS["run"].start(order, attempt)


@pytest.mark.parametrize(
    "killed_in",
    ["export", *(pytest.param(s, marks=pytest.mark.slow) for s in ("generate", "finish"))],
)
def test_a_resumed_run_is_the_same(inputs, weights: Path, killed_in: str) -> None:
    request = inputs.request(weights).model_copy(update={"video_size": (64, 64)})
    run_take(request, lambda stage, done: None)
    again = inputs.folder / "again"
    order = RunRequest(
        session=inputs.session,
        object=inputs.mesh,
        mount=inputs.mount,
        output=again,
        samples=2,
        steps=2,
        weights=weights,
        video_size=(64, 64),
    )
    told: dict[str, object] = {}
    first = begin(order, told)
    assert list(first.stages) == STAGES
    for stage in STAGES[: STAGES.index(killed_in) + 1]:
        if stage != "finish":
            first.stages[stage]()
    assert not again.exists()
    ordered: list[Request] = []
    second = begin(order, told, ordered)
    for stage in STAGES[STAGES.index(killed_in) :]:
        second.stages[stage]()

    for name in (MOTION, GLB, CONTACTS):
        assert (again / name).read_bytes() == (inputs.output / name).read_bytes()
    ours, theirs = load_result(again).manifest, load_result(inputs.output).manifest
    assert (ours.scores, ours.notes, ours.faults, ours.files) == (
        theirs.scores,
        theirs.notes,
        theirs.faults,
        theirs.files,
    )
    assert ours.options == theirs.options
    assert ordered == [order.video]
    assert told["video_job"] == "1" * 16
    assert told["verdict"] in ("good", "usable with limits")
    assert told["scores"] == theirs.scores[theirs.chosen]
    # The last stage once more, as when its worker was killed after it: nothing happens.
    begin(order, told).stages["finish"]()
    assert sorted(path.name for path in inputs.folder.iterdir() if "again" in path.name) == [
        "again"
    ]
