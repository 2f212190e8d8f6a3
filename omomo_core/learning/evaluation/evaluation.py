"""A whole evaluation: every clip under every protocol, and the averages."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.learning.evaluation.clip_sources import Recorded, read_recorded
from omomo_core.learning.evaluation.evaluation_runner import (
    Answer,
    Ask,
    EvaluationRun,
    EvaluationRunner,
    FigureOrigin,
    Progress,
)
from omomo_core.learning.evaluation.metrics import Row, average, spread
from omomo_core.learning.evaluation.protocols import (
    BASELINE,
    RECORDED,
    BodyChoice,
    ask,
    asked_of,
    protocol_of,
)
from omomo_core.stages.network_file import digest_of, read_header
from omomo_core.weights.load import SHIPPED, load_stages


@dataclass(frozen=True)
class ClipResult:
    """What was measured on one clip."""

    clip: str
    object: str
    text: str
    frames: int
    answers: dict[str, Answer]
    """The answer to each protocol, the baseline and the recorded people."""


@dataclass(frozen=True)
class Evaluation:
    """Every clip's figures, and where they come from."""

    samples: int
    clips: list[ClipResult]
    origin: FigureOrigin

    def table(self) -> dict[str, Any]:
        """{protocol: {"K1": {metric: value}, "K20": ..., "mean_of_samples": ...}}, means over clips."""
        best = f"K{self.samples}"
        out: dict[str, Any] = {}
        for protocol in self.clips[0].answers:
            answers = [clip.answers[protocol] for clip in self.clips]
            one, least = [a.one for a in answers], [a.best for a in answers]
            if protocol == BASELINE:
                out[protocol] = {"K1": average(one), best: average(least)}
            elif protocol != RECORDED:
                out[protocol] = {
                    "K1": average(one) | spread(one),
                    best: average(least) | spread(least),
                    "mean_of_samples": average([a.mean for a in answers]),
                }
        return out

    def recorded(self) -> Row:
        """Means of the recorded people's own values."""
        return average([clip.answers[RECORDED].one for clip in self.clips])

    def by_object(self) -> dict[str, "Evaluation"]:
        """The clips of each class of objects, by its name."""
        parts: dict[str, Evaluation] = {}
        for clip in sorted(self.clips, key=lambda clip: clip.object):
            parts.setdefault(clip.object, replace(self, clips=[])).clips.append(clip)
        return parts

    def figures(self) -> dict[str, Any]:
        """All of it, for a JSON file: the table, the clips' own values, a row per clip."""
        return {
            **self.table(),
            RECORDED: self.recorded(),
            "objects": {
                name: {"clips": len(part.clips), **part.table(), RECORDED: part.recorded()}
                for name, part in self.by_object().items()
            },
            "clips": [self._row(clip) for clip in self.clips],
        }

    def _row(self, clip: ClipResult) -> dict[str, Any]:
        names = {"clip": clip.clip, "text": clip.text, "frames": clip.frames}
        names["object"] = clip.object
        table = replace(self, clips=[clip]).table()
        return {**names, **table, "real_clip": clip.answers[RECORDED].one}


def evaluate(
    sources: Sequence[Path],
    protocols: Sequence[str],
    options: GenerationOptions,
    weights: Path | None = None,
    whose: BodyChoice = "person",
    *,
    kept: Path | None = None,
    workers: int = 1,
    progress: Progress = lambda done, total: None,
) -> Evaluation:
    """Measure a generator on clips.

    Args:
        sources: clips as `read_recorded` takes them; those that cannot be used are skipped and named.
        protocols: some of PROTOCOLS.
        options: samples (K) and seed.
        weights: folder of the networks; those that ship, if not given.
        whose: bones of the generated people.
        kept: file of answers, from which an interrupted evaluation goes on.
        workers: processes.
        progress: called with the answers that are there, and with all.

    Raises:
        InputError: as `EvaluationRunner.run`; ``no-usable-clips`` when not one clip can be used.
        AssetError: weights are missing or damaged.
    """
    folder = weights or SHIPPED / "capture"
    networks = [read_header(folder / f"{name}.safetensors") for name in ("hands", "body")]
    runner = EvaluationRunner(
        sources,
        partial(_read, sources),
        partial(_load, options, weights, whose),
        {**asdict(options), "body": whose, "weights": digest_of(networks)},
        {"capture": networks},
        kept,
        workers,
    )
    run = runner.run([asked_of(name) for name in (*protocols, BASELINE, RECORDED)], progress)
    if clips := _results(run):
        return Evaluation(options.samples, clips, run.origin)
    raise InputError(
        "no-usable-clips",
        f"Not one clip can be used. {next(iter(run.origin.failed.values()))}",
        where=", ".join(run.origin.sources),
        fix="Leave those clips or that protocol out.",
    )


def _read(sources: Sequence[Path]) -> Recorded:
    return read_recorded(sources, load_body())


def _load(options: GenerationOptions, weights: Path | None, whose: BodyChoice) -> Ask:
    body = load_body() if whose == "shipped" else None
    return partial(ask, stages=load_stages("capture", weights), options=options, body=body)


def _results(run: EvaluationRun) -> list[ClipResult]:
    """Clips to which every protocol has an answer."""
    answers: dict[str, dict[str, Answer]] = {}
    for answer in run.answers:
        answers.setdefault(answer.task.window, {})[protocol_of(answer.task)] = answer
    return [
        ClipResult(clip.name, clip.motion.mesh.name, clip.text, len(clip.root), answers[clip.name])
        for clip in run.clips
        if not any(answer.problem for answer in answers[clip.name].values())
    ]
