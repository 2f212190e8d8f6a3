"""`omocap train`: train the networks of a method on clips; stop and resume at any time."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

if TYPE_CHECKING:
    from omomo_core.learning.methods import NetworkPlan
    from omomo_core.learning.recordings.clips import Clip
    from omomo_core.learning.training.corpus import Corpus
    from omomo_core.learning.training.team import Team
    from omomo_core.learning.training.trainee import TrainOptions

Word = TypeVar("Word", bound=str)


Method = Annotated[str, typer.Argument(help="capture (what ships), omomo, single-stage or goal.")]
Data = Annotated[
    list[Path],
    typer.Argument(
        help="Recordings (folders or files: BVH, npz, AMASS, the OMOMO release's .p), or clips "
        "of `omocap data build` and data sets of `omocap data synthesise`."
    ),
]
Out = Annotated[
    Path, typer.Option("-o", "--out", help="Folder of the run; given again, it resumes.")
]
Stage = Annotated[
    str, typer.Option(help="hands, body, or both one after the other (capture, omomo).")
]
Size = Annotated[
    str,
    typer.Option(help="published, or laptop: smaller networks (omomo, single-stage, goal)."),
]
StartFrom = Annotated[
    Path | None,
    typer.Option(
        help="Folder of weights to go on from, of the same method and size, or the word "
        "shipped for those that ship (capture).",
        show_default=False,
    ),
]
Steps = Annotated[
    int | None, typer.Option(help="Optimiser steps per network; else as the method's recipe.")
]
Rate = Annotated[
    float | None, typer.Option(help="Peak learning rate; else as the method's recipe.")
]
SynthesisShare = Annotated[
    float,
    typer.Option(help="Share of windows with an object in the batches of capture's body."),
]
Seed = Annotated[int, typer.Option(help="Seed of weights, windows, noise and synthesis.")]
Synthetic = Annotated[
    int | None,
    typer.Option(
        help="Clips with objects to synthesise from recordings; by default 4200, or none "
        "where the data has objects already.",
        min=0,
    ),
]
ShareAlike = Annotated[
    bool, typer.Option(help="Use share-alike sources (HDM05); weights inherit the licence.")
]
BvhUnit = Annotated[str, typer.Option(help="Unit of BVH files: cm, m, mm or in.")]
ObjectSplit = Annotated[
    bool,
    typer.Option("--object-split", help="Of the release's files use the paper's ten objects only."),
]


def train(
    method: Method,
    data: Data,
    out: Out,
    stage: Stage = "both",
    size: Size = "published",
    start_from: StartFrom = None,
    steps: Steps = None,
    batch: Annotated[int, typer.Option(help="Windows of 4 s per step.", min=1)] = 64,
    rate: Rate = None,
    synthesis_share: SynthesisShare = 0.75,
    seed: Seed = 0,
    save_every: Annotated[int, typer.Option(help="Steps between saves.", min=1)] = 500,
    synthetic: Synthetic = None,
    share_alike: ShareAlike = True,
    bvh_unit: BvhUnit = "cm",
    object_split: ObjectSplit = False,
    workers: Annotated[int, typer.Option(help="Processes that synthesise.", min=1)] = 1,
) -> None:
    """Train the networks of a method and write their weights.

    Recordings become clips on our skeleton, people who move things are synthesised from them, and
    both are kept in the folder of the run; unusable files are skipped and counted by reason. The
    folder then holds `<network>.safetensors` (averaged weights; those of capture and omomo are ready
    for `omocap run --weights`) and `<network>.resume`. Interrupt it when you like: the same command
    goes on where it stopped. Several processes share each batch when torchrun starts them (see
    docs/training.md).
    """
    from capture_app.cli.train_data import shared_clips
    from capture_app.training_data import RecordingOptions
    from omomo_core.body.load import load_body
    from omomo_core.learning.training.corpus import Corpus
    from omomo_core.learning.training.team import joined
    from omomo_core.learning.training.trainee import TrainOptions

    plans = _plans(method, size, stage)
    weights = _weights(start_from, plans)
    reading = RecordingOptions(share_alike, _metres(bvh_unit), object_split)
    with joined() as team:
        team.shards(batch)
        clips = shared_clips(
            data, out, reading, team, synthetic=synthetic, seed=seed, workers=workers
        )
        _check_objects(clips, plans)
        notes = {"method": method, "size": size} | _notes(data, clips, team)
        notes |= {"started_from": start_from.name} if start_from else {}
        corpus = Corpus(clips, load_body(), synthesis_share)
        del clips  # the corpus holds what training needs of them
        for name, plan in plans.items():
            options = TrainOptions(steps or plan.steps, batch, rate or plan.rate, seed=seed)
            _train_network(name, plan, corpus, options, weights, out, notes, save_every, team)


def _notes(data: Sequence[Path], clips: "Sequence[Clip]", team: "Team") -> dict[str, str]:
    """What the weights say about where they come from."""
    import torch

    from capture_app.cli.train_data import held_out

    return {
        "data": ", ".join(source.name for source in data),
        "clips": str(len(clips)),
        "clips_held_out": str(held_out(clips)),
        "torch": torch.__version__,
        "processes": str(team.count),
        "device": team.device.type,
        "licences": "; ".join(
            sorted({each for clip in clips for each in clip.licence.split("; ")})
        ),
    }


def _weights(start_from: Path | None, plans: "dict[str, NetworkPlan]") -> Path | None:
    """The folder of the weights to go on from; they fit."""
    from omomo_core.stages.network_file import fill_network
    from omomo_core.weights.load import SHIPPED

    if start_from is None:
        return None
    folder = SHIPPED / "capture" if start_from == Path("shipped") else start_from
    for name, plan in plans.items():
        trainee = plan.make()
        fill_network(trainee.network, trainee.config, folder / f"{name}.safetensors")
    return folder


def _metres(unit: str) -> float:
    from omomo_core.errors import InputError

    known = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
    if unit not in known:
        raise InputError(
            "unknown-unit",
            f"There is no unit {unit!r}.",
            where="--bvh-unit",
            fix=f"Use {', '.join(known)}.",
        )
    return known[unit]


def _train_network(
    name: str,
    plan: "NetworkPlan",
    corpus: "Corpus",
    options: "TrainOptions",
    weights: Path | None,
    out: Path,
    notes: dict[str, str],
    save_every: int,
    team: "Team",
) -> None:
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    from omomo_core.learning.training.checkpoint import resume_run, save_run
    from omomo_core.learning.training.loop import TrainState, start
    from omomo_core.learning.training.loop import train as run

    state = resume_run(plan.make, out, options, team)
    state = state or start(plan.make, corpus, options, team, weights)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed}/{task.total}  loss {task.fields[loss]:.4f}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, disable=not team.leads) as progress:
        task = progress.add_task(name, total=options.steps, loss=state.loss)

        def save() -> None:
            if team.leads:
                save_run(state, out, options, notes)

        def on_step(state: TrainState) -> bool:
            progress.update(task, completed=state.step, loss=state.loss)
            if state.step % save_every == 0:
                save()
            return True

        try:
            run(state, corpus, options, on_step, team)
        finally:
            save()


def _plans(method: str, size: str, stage: str) -> "dict[str, NetworkPlan]":
    """The networks that are asked for, by name."""
    from omomo_core.learning.methods import METHODS, SIZES, networks

    plans = dict(networks(_one_of(METHODS, method, "METHOD"), _one_of(SIZES, size, "--size")))
    if stage == "both":
        return plans
    name = _one_of(tuple(plans), stage, "--stage")
    return {name: plans[name]}


def _one_of(known: "tuple[Word, ...]", word: str, where: str) -> "Word":
    from omomo_core.errors import InputError

    for each in known:
        if each == word:
            return each
    subject = where.lower().removeprefix("--")
    form = " in `omocap train METHOD DATA... -o DIR`" if where == "METHOD" else ""
    raise InputError(
        f"unknown-{subject}",
        f"There is no {subject} {word!r}{' of this method' if subject == 'stage' else ''}.",
        where=where,
        fix=f"Use {', '.join(known)}{form}.",
    )


def _check_objects(clips: "Sequence[Clip]", plans: "dict[str, NetworkPlan]") -> None:
    from omomo_core.errors import InputError

    needing = [name for name, plan in plans.items() if plan.objects]
    if needing and not any(clip.object_motion for clip in clips):
        raise InputError(
            "no-objects",
            f"None of the clips has an object, and {' and '.join(needing)} cannot learn without.",
            fix="Leave out --synthetic 0, or make clips with `omocap data synthesise`.",
        )
