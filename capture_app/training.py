"""Networks learn from clips; clips are synthesised from recorded motion.

Made clips are kept in the folder of the run, so that the same command goes on where it stopped:
``recorded.npz`` (the recordings on our skeleton), ``data.json`` (what was read, and what was left out
and why) and ``synthetic/`` (a data set of `omocap data synthesise`).
"""

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

import torch

from capture_app.commands.train import SynthesisRequest, TrainRequest
from omomo_core.body.model import BodyModel, load_body
from omomo_core.errors import InputError
from omomo_core.learning.recordings import dataset
from omomo_core.learning.recordings.clips import Clip, load_clips, read_index, save_clips
from omomo_core.learning.recordings.dataset import CARD, Summary, shards
from omomo_core.learning.recordings.recordings import build_mocap, motion_files
from omomo_core.learning.recordings.splits import by_side
from omomo_core.learning.synthesis import synthesis_engine
from omomo_core.learning.synthesis.synthesis_engine import Roster, classes_of, people_of
from omomo_core.learning.trainable_methods import NetworkPlan, networks
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
from omomo_core.whole_file import write_whole


class TrainingReport:
    """Is called while `train` and `synthesise_data` work; this one keeps silent, others override it."""

    def mute(self) -> None:
        """Another process reports the same run."""

    @contextmanager
    def counting(self, label: str) -> Generator[Callable[[int, int], None]]:
        """Give what is called with (done, total) while files are read or clips are made."""
        yield lambda done, total: None

    @contextmanager
    def steps(self, network: str, total: int) -> Generator[Callable[[int, float], None]]:
        """Give what is called with (step, loss) after each step of a network's training."""
        yield lambda step, loss: None

    def left_out(self, reasons: Counter[str], details: Path | None = None) -> None:
        """Recordings were left out: how many for each reason, and a file that says which."""

    def gathered(self, clips: Sequence[Clip]) -> None:
        """These are the clips that networks are trained on."""

    def synthesised(self, data_set: Path, summary: Summary) -> None:
        """A data set is whole."""

    def interrupted(self, data_set: Path, kept: int, count: int) -> None:
        """Synthesis was interrupted; the data set holds `kept` clips of `count`."""


RECORDED, REPORT, SYNTHETIC = "recorded.npz", "data.json", "synthetic"


def split(sources: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Split the sources into clips and recordings.

    Raises:
        InputError: ``no-training-data`` when one is not there.
    """
    for source in sources:
        if not source.exists():
            raise InputError(
                "no-training-data",
                "The training data is not there.",
                where=str(source),
                fix="Give clips, a data set, or a folder of recordings.",
            )
    clips = [source for source in sources if holds_clips(source)]
    return clips, [source for source in sources if source not in clips]


def holds_clips(source: Path) -> bool:
    """Whether `load_clips` reads it: a data set, a file of clips, or a folder of such files."""
    if source.is_dir():
        files = sorted(source.glob("*.npz"))[:1]
        return (source / CARD).is_file() or any(holds_clips(file) for file in files)
    if source.suffix.lower() != ".npz":
        return False
    try:
        read_index(source)
    except InputError:
        return False
    return True


def gather(
    sources: Sequence[Path], request: TrainRequest, body: BodyModel, report: TrainingReport
) -> list[Clip]:
    """Clips of recordings, from the run's folder when they were made before.

    Args:
        sources: files and folders of recordings.
        request: the run, and how recordings are read.
        body: whose proportions the clips get.
        report: is called with how many files were read, and what was left out.

    Raises:
        InputError: ``run-differs`` when the run was begun with other data, and as `build_mocap`.
    """
    fingerprint, run = _fingerprint(sources, request), request.output
    kept, card = run / RECORDED, run / REPORT
    if kept.is_file() and card.is_file():
        before = json.loads(card.read_text(encoding="utf-8"))
        if before.get("fingerprint") != fingerprint:
            raise InputError(
                "run-differs",
                "This run was begun with other recordings, or they have changed.",
                where=str(run),
                fix="Give another folder with ‹output›.",
            )
        dropped = Counter[str](before["left_out"])
    else:
        dropped = _record(sources, request, body, report, fingerprint)
    report.left_out(dropped, card)
    # As they will be read when the run goes on, to the last bit.
    return load_clips(kept)


def _record(
    sources: Sequence[Path],
    request: TrainRequest,
    body: BodyModel,
    report: TrainingReport,
    fingerprint: str,
) -> Counter[str]:
    """Write the clips of recordings and what became of each file; returns what was left out."""
    clips, dropped = list[Clip](), Counter[str]()
    problems: list[InputError] = []
    for source in sources:
        with report.counting(f"read {source.name}") as progress:
            clips += build_mocap(
                source,
                body,
                share_alike=request.share_alike,
                progress=progress,
                dropped=dropped,
                skipped=problems,
                metres_per_unit=request.metres_per_unit,
                object_split=request.object_split,
            )
    request.output.mkdir(parents=True, exist_ok=True)
    save_clips(request.output / RECORDED, clips)
    card = {
        "fingerprint": fingerprint,
        "sources": [str(s) for s in sources],
        "clips": len(clips),
        "with_objects": sum(c.object_motion is not None for c in clips),
        "left_out": dict(dropped.most_common()),
        "problems": [str(p) for p in problems],
    }
    write_whole(request.output / REPORT, json.dumps(card, indent=2) + "\n")
    return dropped


def _fingerprint(sources: Sequence[Path], request: TrainRequest) -> str:
    """The same for the same files, read the same way."""
    # The words are those that runs of earlier versions were begun with.
    reading = (
        f"RecordingOptions(share_alike={request.share_alike!r}, "
        f"metres_per_unit={request.metres_per_unit!r}, object_split={request.object_split!r})"
    )
    digest = hashlib.sha256(reading.encode())
    for source in sources:
        for file in motion_files(source):
            digest.update(f"{file.name} {file.stat().st_size} {file.stat().st_mtime_ns}".encode())
    return digest.hexdigest()[:16]


def synthesise_data(request: SynthesisRequest, report: TrainingReport) -> None:
    """Write the data set of the request's folder, or the files of it that are missing.

    Args:
        request: from what, and how many clips.
        report: is called when something is left out, and with how far it is.

    Raises:
        InputError: as `people_of`, `classes_of`, `build_mocap`, `load_clips`,
            `open_dataset`, `missing_indices` and `engine.synthesise`.
    """
    # Before the recordings are read, which may take minutes.
    roster = Roster(people_of(request.people), classes_of(request.objects))
    out = request.output
    body = load_body()
    recorded = _recorded(request.mocap, body, report, share_alike=request.share_alike)
    recipe = dataset.DatasetRecipe(
        request.seed, synthesis_engine.RECIPE, dataset.digest(recorded),
        people=roster.people_text, objects=roster.objects_text,
    )  # fmt: skip
    dataset.open_dataset(out, recipe, recorded)
    try:
        _write_missing(request, recorded, body, roster, report)
    except KeyboardInterrupt:
        report.interrupted(out, dataset.write_card(out, recipe).clips, request.count)
        raise
    report.synthesised(out, dataset.write_card(out, recipe))


def _recorded(
    sources: Sequence[Path], body: BodyModel, report: TrainingReport, *, share_alike: bool
) -> list[Clip]:
    """Clips without objects, of files of clips, data sets and recordings, in the order given."""
    clips, dropped = list[Clip](), Counter[str]()
    for source in sources:
        if holds_clips(source):
            kept = source / dataset.RECORDED
            clips += [
                clip
                for clip in load_clips(kept if kept.is_file() else source)
                if clip.object_motion is None and (share_alike or "BY-SA" not in clip.licence)
            ]
            continue
        with report.counting(f"read {source.name}") as progress:
            clips += build_mocap(
                source, body, share_alike=share_alike, progress=progress, dropped=dropped
            )
    report.left_out(dropped)
    return clips


def _write_missing(
    request: SynthesisRequest,
    recorded: Sequence[Clip],
    body: BodyModel,
    roster: Roster,
    report: TrainingReport,
) -> None:
    """Make the clips that the data set lacks, and write them file by file."""
    indices = dataset.missing_indices(request.output, request.count)
    there, rejected = request.count - len(indices), Counter[str]()
    with report.counting("synthesise") as progress:
        clips = synthesis_engine.synthesise(
            recorded, body, request.count, request.seed,
            lambda done, _: progress(there + done, request.count),
            workers=request.workers, rejected=rejected, indices=indices,
            roster=roster,
        )  # fmt: skip
        with closing(clips):
            for _ in dataset.write_shards(request.output, indices, clips, rejected):
                pass


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
    """Return how many clips are of the paper's held-out people."""
    sides = by_side(clip.name for clip in clips)
    return len(sides.get("seen", ())) + len(sides.get("unseen", ()))


def _plans(request: TrainRequest) -> dict[str, NetworkPlan]:
    """The networks that are asked for, by name."""
    plans, stage = dict(networks(request.method, request.size)), request.stage
    if stage != "both" and stage not in plans:
        raise InputError(
            "unknown-stage",
            f"There is no stage {stage!r} of this method.",
            field="stage",
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
    synthesis = SynthesisRequest(
        mocap=(request.output / RECORDED,),
        output=folder,
        count=count,
        seed=request.seed,
        workers=request.workers,
    )
    synthesise_data(synthesis, report)
    return [clip for file in shards(folder) for clip in load_clips(file)]


def _check_objects(clips: Sequence[Clip], plans: dict[str, NetworkPlan]) -> None:
    needing = [name for name, plan in plans.items() if plan.objects]
    if needing and not any(clip.object_motion for clip in clips):
        raise InputError(
            "no-objects",
            f"None of the clips has an object, and {' and '.join(needing)} cannot learn without.",
            fix="Leave out ‹synthetic› 0, or make clips with ‹omocap data synthesise›.",
        )


def _notes(request: TrainRequest, clips: Sequence[Clip], group: ProcessGroup) -> dict[str, str]:
    """Return what the weights say about where they come from."""
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
