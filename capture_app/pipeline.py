"""The whole story: a phone's log, a mesh and a mount become a result folder."""

from capture_app.chosen import write_chosen
from capture_app.describe import describe
from capture_app.manifest import write_manifest
from capture_app.prepare import prepare_take
from capture_app.progress import Progress, StageClock
from capture_app.request import TakeRequest
from capture_app.result import MANIFEST, MOTION, Result, load_result, save_motion
from capture_app.staging import staged_folder
from omomo_core.generation.generator import generate
from omomo_core.generation.known import Known


def run_take(request: TakeRequest, progress: Progress) -> Result:
    """Turn a take into a result folder; nothing is left behind when it fails.

    Args:
        request: the inputs and options; all are checked before the slow part starts.
        progress: told each stage ("read", "object", "hands", "contact", "body", "solve", "export",
            "video") and how far it is.

    Returns:
        The result, as it is on the disk.

    Raises:
        InputError: an input cannot give a correct motion, or the output folder cannot be made.
        AssetError: the body or the weights are missing or damaged.
    """
    clock = StageClock(progress)
    clock("read", 0.0)
    prepared = prepare_take(request)
    moved, body, known = prepared.motion, prepared.body, Known(contacts=prepared.contacts)
    with staged_folder(request.output, replace=request.replace) as folder:
        clock("read", 1.0)
        made = generate(moved, body, prepared.stages, request.options, clock, known)
        clock("export", 0.0)
        save_motion(folder / MOTION, made.people, made.chosen, moved, body.name)
        write_chosen(
            folder,
            made.people[made.chosen],
            moved,
            body,
            clock,
            contacts=request.segments,
            video_size=request.video_size,
        )
        files = tuple(sorted(path.name for path in folder.iterdir()))
        manifest = describe(request, prepared, made, clock.seconds, files)
        write_manifest(folder / MANIFEST, manifest)
    return load_result(request.output)
