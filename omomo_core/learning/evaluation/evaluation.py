"""A whole evaluation: every clip under every protocol, and the averages."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.generation.generation_options import GenerationOptions, Progress, no_progress
from omomo_core.learning.evaluation.metrics import Row, average, spread
from omomo_core.learning.evaluation.protocols import (
    BASELINE,
    BodyChoice,
    ask,
    own_values,
    unlearned,
)
from omomo_core.learning.evaluation.real_clips import RealClip, read_clip
from omomo_core.learning.evaluation.truth import MeasuredSamples, Truth
from omomo_core.stages.stage import Stages


@dataclass(frozen=True)
class ClipResult:
    """What was measured on one clip."""

    clip: str
    object: str
    text: str
    frames: int
    own: Row
    answers: dict[str, MeasuredSamples]
    baseline: tuple[Row, Row]


@dataclass(frozen=True)
class Evaluation:
    """Every clip's figures, and the clips that could not be used with the reason."""

    samples: int
    clips: list[ClipResult] = field(default_factory=list)
    skipped: dict[str, str] = field(default_factory=dict)

    def table(self) -> dict[str, Any]:
        """{protocol: {"K1": {metric: value}, "K20": ..., "mean_of_samples": ...}}, means over clips."""
        best = f"K{self.samples}"
        out: dict[str, Any] = {}
        for protocol in self.clips[0].answers:
            answers = [clip.answers[protocol] for clip in self.clips]
            out[protocol] = {
                "K1": _summary([a.one for a in answers]),
                best: _summary([a.best for a in answers]),
                "mean_of_samples": average([a.mean for a in answers]),
            }
        out[BASELINE] = {
            "K1": average([clip.baseline[0] for clip in self.clips]),
            best: average([clip.baseline[1] for clip in self.clips]),
        }
        return out

    def recorded(self) -> Row:
        """Means of the recorded people's own values."""
        return average([clip.own for clip in self.clips])

    def by_object(self) -> dict[str, "Evaluation"]:
        """The clips of each class of objects, by its name."""
        parts: dict[str, Evaluation] = {}
        for clip in sorted(self.clips, key=lambda clip: clip.object):
            parts.setdefault(clip.object, Evaluation(self.samples)).clips.append(clip)
        return parts

    def document(self, settings: dict[str, Any]) -> dict[str, Any]:
        """All of it, for a JSON file: the table, the clips' own values, a row per clip, the rest."""
        return {
            **self.table(),
            "real_clips": self.recorded(),
            "objects": {
                name: {"clips": len(part.clips), **part.table(), "real_clips": part.recorded()}
                for name, part in self.by_object().items()
            },
            "clips": [self._row(clip) for clip in self.clips],
            "skipped": self.skipped,
            "settings": settings,
        }

    def _row(self, clip: ClipResult) -> dict[str, Any]:
        alone = Evaluation(self.samples, [clip])
        names = {"clip": clip.clip, "text": clip.text, "frames": clip.frames}
        names["object"] = clip.object
        return {**names, **alone.table(), "real_clip": clip.own}


def _summary(rows: Sequence[Row]) -> Row:
    return average(rows) | spread(rows)


def evaluate(
    paths: Sequence[Path],
    protocols: Sequence[str],
    stages: Stages,
    body: BodyModel,
    options: GenerationOptions,
    whose: BodyChoice = "person",
    on_progress: Progress = no_progress,
) -> Evaluation:
    """Measure a generator on clips.

    Args:
        paths: the clips; those that cannot be used are skipped, named and counted.
        protocols: some of PROTOCOLS.
        stages: the networks.
        body: the shipped body.
        options: samples (K) and seed.
        whose: bones of the generated people.
        on_progress: called with the clip and protocol, and the fraction of all clips done.

    Raises:
        InputError: not one clip can be used.
    """
    evaluation = Evaluation(options.samples)
    for i, path in enumerate(paths):
        try:
            clip = read_clip(path, body)
        except InputError as error:
            evaluation.skipped[path.name] = str(error)
            continue

        def step(protocol: int, name: str, done: float, i: int = i, path: Path = path) -> None:
            part = (protocol + 0.5 * done + (0.5 if name != "hands" else 0)) / len(protocols)
            what = f"{path.stem}, {protocols[protocol]}"
            on_progress(what, (i + min(1.0, part)) / len(paths))

        evaluation.clips.append(_measure(clip, protocols, stages, body, options, whose, step))
    if not evaluation.clips:
        raise InputError(
            "no-usable-clips",
            f"None of the {len(paths)} clips can be used. {next(iter(evaluation.skipped.values()))}",
            where=str(paths[0].parent),
            fix="See docs/evaluation.md for the layout of a clip.",
        )
    return evaluation


def _measure(
    clip: RealClip,
    protocols: Sequence[str],
    stages: Stages,
    body: BodyModel,
    options: GenerationOptions,
    whose: BodyChoice,
    step: Callable[[int, str, float], None],
) -> ClipResult:
    theirs, truth = clip.body if whose == "person" else body, Truth(clip)
    answers = {
        protocol: ask(
            truth, protocol, stages, options, theirs, lambda name, done, k=k: step(k, name, done)
        )
        for k, protocol in enumerate(protocols)
    }
    return ClipResult(
        clip=clip.name,
        object=clip.motion.mesh.name,
        text=clip.text,
        frames=len(clip.root),
        own=own_values(truth),
        answers=answers,
        baseline=unlearned(truth, options.samples, options.seed),
    )
