"""The whole story: a phone's log, a mesh and a mount become a result folder."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import UInt8

from capture_app.describe import describe
from capture_app.exports.glb import write_glb
from capture_app.manifest import write_manifest
from capture_app.prepare import PreparedTake, prepare_take
from capture_app.progress import Progress, StageClock
from capture_app.request import TakeRequest
from capture_app.result import GLB, MANIFEST, MOTION, VIDEO, Result, load_result, save_motion
from capture_app.staging import staged_folder
from omomo_core.generation.generator import generate
from omomo_core.motion import FPS, HumanMotion
from render.third_person import frames
from render.video import write_video


def run_take(request: TakeRequest, progress: Progress) -> Result:
    """Turn a take into a result folder; nothing is left behind when it fails.

    Args:
        request: the inputs and options; all are checked before the slow part starts.
        progress: told each stage ("read", "hands", "body", "solve", "export", "video") and how
            far it is.

    Returns:
        The result, as it is on the disk.

    Raises:
        InputError: an input cannot give a correct motion, or the output folder cannot be made.
        AssetError: the body or the weights are missing or damaged.
    """
    clock = StageClock(progress)
    clock("read", 0.0)
    prepared = prepare_take(request)
    with staged_folder(request.output, replace=request.replace) as folder:
        clock("read", 1.0)
        people = generate(prepared.motion, prepared.body, prepared.stages, request.options, clock)
        best = people.motions[people.chosen]
        clock("export", 0.0)
        body_name = prepared.body.name
        save_motion(folder / MOTION, people.motions, people.chosen, prepared.motion, body_name)
        write_glb(folder / GLB, best, prepared.motion, prepared.body)
        clock("export", 1.0)
        if request.video_size:
            pictures = _watched(best, prepared, request.video_size, clock)
            write_video(folder / VIDEO, pictures, FPS)
        files = tuple(sorted(path.name for path in folder.iterdir()))
        manifest = describe(request, prepared, people, clock.seconds, files)
        write_manifest(folder / MANIFEST, manifest)
    return load_result(request.output)


def _watched(
    best: HumanMotion, prepared: PreparedTake, size: tuple[int, int], progress: Progress
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """The video's pictures, told to `progress` as they are drawn."""
    pictures = frames(best, prepared.motion, prepared.body, width=size[0], height=size[1])
    for k, picture in enumerate(pictures):
        yield picture
        progress("video", (k + 1) / len(best.root))
