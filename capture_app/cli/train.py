"""`omocap train`: train the stages on clips; stop and resume at any time."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from omomo_core.stage import StageConfig
    from omomo_core.training.corpus import Corpus
    from omomo_core.training.loop import TrainOptions


def train(
    data: Annotated[Path, typer.Argument(help="Clips made by `omocap data build`.")],
    out: Annotated[
        Path, typer.Option("-o", "--out", help="Folder of the run; given again, it resumes.")
    ],
    stage: Annotated[str, typer.Option(help="hands, body, or both one after the other.")] = "both",
    config: Annotated[str, typer.Option(help="capture (the default model) or paper.")] = "capture",
    steps: Annotated[int, typer.Option(help="Optimiser steps per stage.")] = 10_000,
    batch: Annotated[int, typer.Option(help="Windows of 4 s per step.")] = 64,
    rate: Annotated[float, typer.Option(help="Peak learning rate.")] = 5e-4,
    synthesis_share: Annotated[
        float, typer.Option(help="Share of windows with an object in the body stage's batches.")
    ] = 0.7,
    seed: Annotated[int, typer.Option(help="Seed of weights, windows and noise.")] = 0,
    save_every: Annotated[int, typer.Option(help="Steps between saves.")] = 500,
) -> None:
    """Train stage 1 (hands) and stage 2 (body) and write their weights.

    The folder holds `<stage>.safetensors` (the averaged weights, ready for `omocap run --weights`)
    and `<stage>.resume`. Interrupt it when you like: the same command goes on where it stopped.
    """
    import torch

    from omomo_core.body.load import load_body
    from omomo_core.data.clips import load_clips
    from omomo_core.errors import InputError
    from omomo_core.training.corpus import Corpus
    from omomo_core.training.loop import TrainOptions

    stages = ("hands", "body") if stage == "both" else (stage,)
    configs = [_config(name, config) for name in stages]
    if not data.is_file():
        raise InputError(
            "no-training-data",
            "The file of training clips is not there.",
            where=str(data),
            fix="Make one with `omocap data build MOCAP_FOLDER -o FILE`.",
        )
    clips = load_clips(data)
    corpus = Corpus(clips, load_body(), synthesis_share)
    options = TrainOptions(steps=steps, batch=batch, rate=rate, seed=seed)
    notes = {"data": data.name, "clips": str(len(clips)), "torch": torch.__version__}
    notes["licences"] = "; ".join(sorted({clip.licence for clip in clips}))
    for each in configs:
        _train_stage(each, corpus, options, out, notes, save_every)


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
