"""From sessions to orders, and from orders to jobs that are not done yet."""

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from capture_app.commands.request import validated
from capture_app.commands.run import RunRequest
from capture_app.jobs.batch.sessions import unused
from capture_app.jobs.batch.watch import videos_of
from capture_app.jobs.kinds.results import summary_of
from capture_app.jobs.queue import JobQueue, order_id
from capture_app.jobs.record import JobRecord
from capture_app.manifest import MANIFEST, Manifest, read_manifest
from ingest.animated.detect import is_animation
from omomo_core.errors import InputError


def is_whole(folder: Path) -> bool:
    """Whether the numbers of a result can be read; its films may have been moved elsewhere."""
    from capture_app.result import load_result

    try:
        load_result(folder)
    except InputError:
        return False
    return True


def made_by(order: RunRequest) -> Manifest | None:
    """The manifest of the result that stands where the order wants one, if this order made it.

    None where it is of other options or inputs, or of inputs that have changed since.
    """
    from capture_app.rerun import unchanged

    try:
        manifest = read_manifest(order.output / MANIFEST)
        paths = {item.role: Path(item.path) for item in manifest.inputs}
        if manifest.correction is not None or paths != order.inputs:
            return None
        # What an older version did not offer was as it is by default now.
        before = {name: RunRequest.model_fields[name].default for name in order.recorded_options}
        if _as_json({**before, **manifest.options}) != _as_json(order.recorded_options):
            return None
        for item in manifest.inputs:
            unchanged(item)
    except InputError:
        return None
    return manifest


def put_aside(folder: Path) -> Path:
    """Give a damaged result another name, so that a new one can take its place."""
    beside = {path.name: path for path in folder.parent.iterdir()}
    aside = folder.with_name(unused(f"{folder.name}.damaged", beside))
    os.rename(folder, aside)
    return aside


def _as_json(options: object) -> object:
    return json.loads(json.dumps(options))


def order_of(said: dict[str, Any], output: Path) -> RunRequest:
    """The order for one session.

    Args:
        said: about the run, by the names of `RunRequest`; mount "identity" is the phone's own frame.
        output: folder in which the result gets the session's name.

    Raises:
        InputError: "batch-option", or "mount-missing" for a phone's log without one.
    """
    session, mount = Path(said["session"]).absolute(), said.get("mount")
    animated = _animated(session, mounted=mount is not None)
    if mount is None and not animated:
        raise InputError(
            "mount-missing",
            "The place of the phone on the object is not given.",
            where=str(session),
            fix="Find it with `omocap calibrate` and give --mount FILE, or --mount identity if the "
            "mesh is made in the phone's own axes. In a table it may stand in a column.",
        )
    mount = None if animated or mount == "identity" else mount
    paths = {"session": session, "mount": mount, "output": output / said["name"]}
    if animated and said.get("stood") == "phone":
        paths["stood"] = None
    order = validated(
        RunRequest, {**said, **paths, "animated": animated}, "batch-option", where=said["name"]
    )
    return order.model_copy(update={role: path.absolute() for role, path in order.inputs.items()})


def submit_batch(queue: JobQueue, orders: Sequence[RunRequest]) -> tuple[list[str], list[str]]:
    """Put into the queue what is not done: what is there already is not doubled.

    What failed or was cancelled before is tried again, and so is what is done but has lost its result.
    A damaged result is put aside and made again. A result that a queue knows nothing of, because
    its database was lost, counts as done where the same order made it.

    Returns:
        Ids of all jobs, in the order of the orders, and what is to be told, in sentences.
    """
    wanted = {order_id(order): order for order in orders}
    known = {job.id for job in queue.get_all(list(wanted))}
    for id, order in wanted.items():
        if id not in known and (manifest := made_by(order)) is not None:
            queue.adopt(id, order, timings=manifest.timings, summary=summary_of(manifest))
    queue.submit_all(wanted.items())
    notes: list[str] = []
    for job in queue.get_all(list(wanted)):
        output = wanted[job.id].output
        if job.state in ("failed", "cancelled") or (job.state == "done" and not output.exists()):
            queue.again(job.id)
        elif job.state == "done" and not is_whole(output):
            aside = put_aside(output)
            notes.append(
                f"The result {output.name} was damaged; it is now {aside.name}, and made again."
            )
            queue.again(job.id)
        else:
            _again_video(queue, job)
    return [order_id(order) for order in orders], notes


def _again_video(queue: JobQueue, job: JobRecord) -> None:
    """Try a video once more that could not be drawn."""
    for video in queue.get_all(videos_of([job])):
        if video.state in ("failed", "cancelled"):
            queue.again(video.id)


def _animated(session: Path, *, mounted: bool) -> bool:
    try:
        return is_animation(session, mounted=mounted)
    except InputError as error:
        # A mount for all sessions is not meant for those without a phone; what else is wrong with
        # a session, its job will tell.
        return error.code == "mount-unused"
    except OSError:
        return False
