"""synthesise_data: recorded motion becomes a data set of people who move things."""

from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

from capture_app.commands.train import SynthesisRequest
from capture_app.training_data import holds_clips
from capture_app.training_report import TrainingReport
from omomo_core.body.model import BodyModel, load_body
from omomo_core.learning.recordings import dataset
from omomo_core.learning.recordings.clips import Clip, load_clips
from omomo_core.learning.recordings.recordings import build_mocap
from omomo_core.learning.synthesis import engine
from omomo_core.learning.synthesis.engine import Roster, classes_of, people_of


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
        request.seed, engine.RECIPE, dataset.digest(recorded),
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
        clips = engine.synthesise(
            recorded, body, request.count, request.seed,
            lambda done, _: progress(there + done, request.count),
            workers=request.workers, rejected=rejected, indices=indices,
            roster=roster,
        )  # fmt: skip
        with closing(clips):
            for _ in dataset.write_shards(request.output, indices, clips, rejected):
                pass
