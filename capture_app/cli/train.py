"""`omocap train`: train the stages on clips; stop and resume at any time."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from omomo_core.data.clips import Clip
    from omomo_core.stage import StageConfig
    from omomo_core.training.corpus import Corpus
    from omomo_core.training.loop import TrainOptions


def train(
    data: Annotated[
        list[Path],
        typer.Argument(
            help="Recordings (folders or files: BVH, npz, AMASS, the OMOMO release's .p), or clips "
            "of `omocap data build` and data sets of `omocap data synthesise`."
        ),
    ],
    out: Annotated[
        Path, typer.Option("-o", "--out", help="Folder of the run; given again, it resumes.")
    ],
    stage: Annotated[str, typer.Option(help="hands, body, or both one after the other.")] = "both",
    config: Annotated[str, typer.Option(help="capture (the default model) or paper.")] = "capture",
    steps: Annotated[
        int | None, typer.Option(help="Optimiser steps per stage; else as for the shipped weights.")
    ] = None,
    batch: Annotated[int, typer.Option(help="Windows of 4 s per step.")] = 64,
    rate: Annotated[float, typer.Option(help="Peak learning rate.")] = 1e-3,
    synthesis_share: Annotated[
        float, typer.Option(help="Share of windows with an object in the body stage's batches.")
    ] = 0.75,
    seed: Annotated[int, typer.Option(help="Seed of weights, windows, noise and synthesis.")] = 0,
    save_every: Annotated[int, typer.Option(help="Steps between saves.")] = 500,
    synthetic: Annotated[
        int | None,
        typer.Option(
            help="Clips with objects to synthesise from recordings; by default 4200, or none "
            "where the data has objects already.",
            min=0,
        ),
    ] = None,
    share_alike: Annotated[
        bool, typer.Option(help="Use share-alike sources (HDM05); weights inherit the licence.")
    ] = True,
    bvh_unit: Annotated[str, typer.Option(help="Unit of BVH files: cm, m, mm or in.")] = "cm",
    workers: Annotated[int, typer.Option(help="Processes that synthesise.", min=1)] = 1,
) -> None:
    """Train stage 1 (hands) and stage 2 (body) and write their weights.

    Recordings become clips on our skeleton, people who move things are synthesised from them, and
    both are kept in the folder of the run; unusable files are skipped and counted by reason. The
    folder then holds `<stage>.safetensors` (averaged weights, ready for `omocap run --weights`) and
    `<stage>.resume`. Interrupt it when you like: the same command goes on where it stopped.
    """
    from capture_app.cli.train_data import training_clips
    from capture_app.training_data import Reading
    from omomo_core.body.load import load_body
    from omomo_core.training.corpus import Corpus
    from omomo_core.training.loop import SHIPPED_STEPS, TrainOptions

    stages = ("hands", "body") if stage == "both" else (stage,)
    configs = [_config(name, config) for name in stages]
    reading = Reading(share_alike, _metres(bvh_unit))
    clips = training_clips(data, out, reading, synthetic=synthetic, seed=seed, workers=workers)
    notes = _notes(data, clips)
    corpus = Corpus(clips, load_body(), synthesis_share)
    del clips  # the corpus holds what training needs of them
    for each in configs:
        options = TrainOptions(steps or SHIPPED_STEPS[each.stage], batch, rate, seed=seed)
        _train_stage(each, corpus, options, out, notes, save_every)


def _notes(data: Sequence[Path], clips: "Sequence[Clip]") -> dict[str, str]:
    """What the weights say about where they come from."""
    import torch

    return {
        "data": ", ".join(source.name for source in data),
        "clips": str(len(clips)),
        "torch": torch.__version__,
        "licences": "; ".join(sorted({clip.licence for clip in clips})),
    }


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


def _train_stage(
    config: "StageConfig",
    corpus: "Corpus",
    options: "TrainOptions",
    out: Path,
    notes: dict[str, str],
    save_every: int,
) -> None:
    import torch
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    from omomo_core.training.checkpoint import resume_run, save_run
    from omomo_core.training.loop import TrainState, start
    from omomo_core.training.loop import train as run

    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    state = resume_run(config, out, options) or start(config, corpus, options)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed}/{task.total}  loss {task.fields[loss]:.4f}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns) as progress:
        task = progress.add_task(config.stage, total=options.steps, loss=state.loss)

        def on_step(state: TrainState) -> bool:
            progress.update(task, completed=state.step, loss=state.loss)
            if state.step % save_every == 0:
                save_run(state, out, options, notes)
            return True

        try:
            run(state, corpus, options, on_step, device)
        finally:
            save_run(state, out, options, notes)


def _config(stage: str, configuration: str) -> "StageConfig":
    from omomo_core.body_stage import capture as body_capture
    from omomo_core.body_stage import paper as body_paper
    from omomo_core.errors import InputError
    from omomo_core.hand_stage import capture as hand_capture
    from omomo_core.hand_stage import paper as hand_paper

    known = {
        ("hands", "capture"): hand_capture.CONFIG,
        ("body", "capture"): body_capture.CONFIG,
        ("hands", "paper"): hand_paper.CONFIG,
        ("body", "paper"): body_paper.CONFIG,
    }
    if (stage, configuration) not in known:
        raise InputError(
            "unknown-stage",
            f"There is no stage {stage!r} in a configuration {configuration!r}.",
            fix="Use --stage hands, body or both, and --config capture or paper.",
        )
    return known[stage, configuration]
