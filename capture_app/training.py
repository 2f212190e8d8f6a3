"""train: the networks of a method learn from clips; a run that was stopped is resumed."""

from collections.abc import Sequence
from pathlib import Path

import torch

from capture_app.commands.train import SynthesisRequest, TrainRequest
from capture_app.synthesis import synthesise_data
from capture_app.training_data import RECORDED, SYNTHETIC, gather, split
from capture_app.training_report import TrainingReport
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.methods import NetworkPlan, networks
from omomo_core.learning.recordings.clips import Clip, load_clips
from omomo_core.learning.recordings.dataset import shards
from omomo_core.learning.recordings.splits import by_side
from omomo_core.learning.training import training_loop
from omomo_core.learning.training.corpus import Corpus
from omomo_core.learning.training.training_loop import (
    ProcessGroup,
    process_group,
    resume_run,
    save_run,
)
from omomo_core.learning.training.training_task import TrainOptions
from omomo_core.motion import FPS
from omomo_core.stages.network_file import fill_network
from omomo_core.weights.load import SHIPPED

DEFAULT_SYNTHETIC = 4200
"""Clips that are synthesised from recordings where little of the data has an object."""
ENOUGH_WITH_OBJECTS = 60 * 60 * FPS
"""Frames with objects, one hour, from which on nothing is synthesised unless that is asked for."""


def train(request: TrainRequest, report: TrainingReport | None = None) -> None:
    """Train the networks of a method and write their weights into the request's folder.

    The folder then holds `<network>.safetensors` (averaged weights; those of capture and omomo are
    ready for `RunRequest.weights`) and `<network>.resume`; the same request goes on from there.

    Args:
        request: which networks, and from what.
        report: is called with what is read, made and left out, and each step; nobody is if None.

    Raises:
        InputError: ``unknown-stage``, ``no-objects``, "batch-not-shared"; as `split`, `gather`,
            `load_clips`, `synthesise_data` and `resume_run`.
        AssetError: the weights to go on from are missing or damaged.
    """
    report = report or TrainingReport()
    plans = _plans(request)
    weights = _weights(request.start_from, plans)
    with process_group() as group:
        group.shards(request.batch)
        clips = _shared_clips(request, group, report)
        _check_objects(clips, plans)
        notes = _notes(request, clips, group)
        corpus = Corpus(clips, load_body(), request.synthesis_share)
        del clips  # the corpus holds what training needs of them
        for name, plan in plans.items():
            _train_network(name, plan, corpus, request, weights, notes, group, report)


def held_out(clips: Sequence[Clip]) -> int:
    """How many clips are of the paper's held-out people."""
    sides = by_side(clip.name for clip in clips)
    return len(sides.get("seen", ())) + len(sides.get("unseen", ()))


def _plans(request: TrainRequest) -> dict[str, NetworkPlan]:
    """The networks that are asked for, by name."""
    plans, stage = dict(networks(request.method, request.size)), request.stage
    if stage != "both" and stage not in plans:
        raise InputError(
            "unknown-stage",
            f"There is no stage {stage!r} of this method.",
            where="--stage",
            fix=f"Use {', '.join(plans)}.",
        )
    return plans if stage == "both" else {stage: plans[stage]}


def _weights(start_from: Path | None, plans: dict[str, NetworkPlan]) -> Path | None:
    """The folder of the weights to go on from; they fit."""
    if start_from is None:
        return None
    folder = SHIPPED / "capture" if start_from == Path("shipped") else start_from
    for name, plan in plans.items():
        task = plan.make()
        fill_network(task.network, task.config, folder / f"{name}.safetensors")
    return folder


def _shared_clips(request: TrainRequest, group: ProcessGroup, report: TrainingReport) -> list[Clip]:
    """The clips, where processes train together: the first makes them, the others read them."""
    if not group.is_main:
        report.mute()
        group.barrier()
    clips = _clips(request, report)
    if group.is_main:
        group.barrier()
    return clips


def _clips(request: TrainRequest, report: TrainingReport) -> list[Clip]:
    """Clips that there are, those of recordings, and those that are synthesised from recordings."""
    ready, recordings = split(request.data)
    clips = [clip for source in ready for clip in load_clips(source)]
    if recordings:
        clips += gather(recordings, request, load_body(), report)
        frames = sum(len(clip.root) for clip in clips if clip.object_motion)
        default = 0 if frames >= ENOUGH_WITH_OBJECTS else DEFAULT_SYNTHETIC
        clips += _synthesised(request, report, default)
    report.gathered(clips)
    return clips


def _synthesised(request: TrainRequest, report: TrainingReport, default: int) -> list[Clip]:
    """Clips with objects from the recordings of the run."""
    count = default if request.synthetic is None else request.synthetic
    if not count:
        return []
    folder = request.output / SYNTHETIC
    wanted = SynthesisRequest(
        mocap=(request.output / RECORDED,),
        output=folder,
        count=count,
        seed=request.seed,
        workers=request.workers,
    )
    synthesise_data(wanted, report)
    return [clip for file in shards(folder) for clip in load_clips(file)]


def _check_objects(clips: Sequence[Clip], plans: dict[str, NetworkPlan]) -> None:
    needing = [name for name, plan in plans.items() if plan.objects]
    if needing and not any(clip.object_motion for clip in clips):
        raise InputError(
            "no-objects",
            f"None of the clips has an object, and {' and '.join(needing)} cannot learn without.",
            fix="Leave out --synthetic 0, or make clips with `omocap data synthesise`.",
        )


def _notes(request: TrainRequest, clips: Sequence[Clip], group: ProcessGroup) -> dict[str, str]:
    """What the weights say about where they come from."""
    notes = {
        "method": request.method,
        "size": request.size,
        "data": ", ".join(source.name for source in request.data),
        "clips": str(len(clips)),
        "clips_held_out": str(held_out(clips)),
        "torch": torch.__version__,
        "processes": str(group.count),
        "device": group.device.type,
        "licences": "; ".join(
            sorted({each for clip in clips for each in clip.licence.split("; ")})
        ),
    }
    return notes | ({"started_from": request.start_from.name} if request.start_from else {})


def _train_network(
    name: str,
    plan: NetworkPlan,
    corpus: Corpus,
    request: TrainRequest,
    weights: Path | None,
    notes: dict[str, str],
    group: ProcessGroup,
    report: TrainingReport,
) -> None:
    """Train one network from where its run stands, and save it every so many steps."""
    options = TrainOptions(
        request.steps or plan.steps, request.batch, request.rate or plan.rate, seed=request.seed
    )
    state = resume_run(plan.make, request.output, options, group)
    state = state or training_loop.start(plan.make, corpus, options, group, weights)

    def save() -> None:
        if group.is_main:
            save_run(state, request.output, options, notes)

    with report.steps(name, options.steps) as progress:

        def on_step(state: training_loop.TrainState) -> bool:
            progress(state.step, state.loss)
            if state.step % request.save_every == 0:
                save()
            return True

        try:
            training_loop.train(state, corpus, options, on_step, group)
        finally:
            save()
