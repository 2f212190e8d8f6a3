"""The runner of evaluations: interrupted, begun otherwise, and in several processes."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from omomo_core.errors import InputError
from omomo_core.learning.evaluation.clip_sources import Recorded
from omomo_core.learning.evaluation.evaluation_runner import (
    Answer,
    Ask,
    EvaluationRun,
    EvaluationRunner,
    Task,
)
from omomo_core.learning.evaluation.truth import MeasuredSamples, Truth
from omomo_core.stages.network_file import Header
from tests.core.movers import mover, resembling, thin

ASKED = [("near", True), ("near", False), ("far", False)]
NETWORKS = {"near": [Header("near/body", "abc", {}, 1)]}


def read(frames: int = 8) -> Recorded:
    clips = [mover(name, frames, k) for k, name in enumerate(("sub1_box_001", "sub2_box_002"))]
    return Recorded([replace(clip, body=thin(clip.body)) for clip in clips], {"x.npz": "Damaged."})


def load(missing: str = "") -> Ask:
    if missing:
        raise InputError("no-networks", f"There is no {missing}.")
    return ask


def ask(truth: Truth, task: Task) -> MeasuredSamples:
    if task == Task("far", "sub2_box_002", False):
        raise InputError("too-hard", "It gives up.")
    away = 0.2 if task.method == "far" else 0.1 - 0.05 * task.first_frame
    people = [resembling(truth.clip, away, k) for k in range(2)]
    return truth.answer(people, 0, truth.clip.body)


def never() -> Ask:
    raise AssertionError("Something is asked again.")


def silent(done: int, total: int) -> None:
    """No progress is shown."""


def run(kept: Path | None, **changes) -> EvaluationRun:
    runner = EvaluationRunner([Path("clips")], read, load, {"seed": 0}, NETWORKS, kept)
    return replace(runner, **changes).run(ASKED, silent)


def killed_after(answers: int, kept: Path) -> None:
    """Run, be interrupted, and leave a part of a line."""

    def killed(done: int, total: int) -> None:
        if done == answers:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        EvaluationRunner([Path("clips")], read, load, {"seed": 0}, NETWORKS, kept).run(
            ASKED, killed
        )
    with kept.open("a") as file:
        file.write('{"task": {"method": "ne')


def test_an_interrupted_run_goes_on_and_ends_as_an_uninterrupted_one(tmp_path: Path):
    kept, seen = tmp_path / "new" / "answers.jsonl", list[int]()
    killed_after(4, kept)
    runner = EvaluationRunner([Path("clips")], read, load, {"seed": 0}, NETWORKS, kept)
    made = runner.run(ASKED, lambda done, total: seen.append(done))
    assert seen == [4, 5, 6]
    alone = run(None)
    assert (made.answers, made.origin) == (alone.answers, alone.origin)
    assert run(kept, load=never).answers == made.answers
    assert list(made.origin.failed) == ["far, sub2_box_002"]
    assert made.origin.skipped == {"x.npz": "Damaged."}
    assert made.origin.settings["seed"] == 0
    assert Answer(Task("near", "no", True), "", "") not in made.answers


def test_a_file_that_was_begun_otherwise_is_refused(tmp_path: Path):
    kept = tmp_path / "answers.jsonl"
    run(kept)
    other = {"near": [Header("near/body", "def", {}, 1)]}
    for changes, named in (
        ({"settings": {"seed": 1}}, "seed was 0, now 1"),
        ({"networks": other}, "the weights of near"),
        ({"read": partial(read, 9)}, "the window sub1_box_001"),
    ):
        with pytest.raises(InputError, match=named) as caught:
            run(kept, **changes)
        assert caught.value.code == "answers-differ"
    for text in ('{"measures": 2, "seed": 0}\n{"no": "answer"}\n', "no JSON\n"):
        kept.write_text(text)
        with pytest.raises(InputError, match="answers-damaged"):
            run(kept)


@pytest.mark.slow
def test_processes_give_what_one_gives(tmp_path: Path):
    kept = tmp_path / "answers.jsonl"
    killed_after(2, kept)
    alone = run(None)
    for file in (None, kept):
        both = run(file, workers=2)
        assert (both.answers, both.origin) == (alone.answers, alone.origin)
    with pytest.raises(InputError, match="There is no body"):
        run(None, workers=2, load=partial(load, "body"))
