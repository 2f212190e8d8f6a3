"""Many sessions at once: found, ordered, and listed in one table of results."""

import csv
import io
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from capture_app.commands.request import validated
from capture_app.commands.run import RunRequest, TakeOptions
from capture_app.commands.spelling import in_options
from capture_app.jobs.batch_watch import videos_of
from capture_app.jobs.job_kinds import summary_of
from capture_app.jobs.job_record import JobRecord
from capture_app.jobs.queue import JobQueue, order_id
from capture_app.manifest import MANIFEST, Manifest, read_manifest
from capture_app.staging import MARK
from ingest.animated.detect import is_animation
from ingest.archive import is_archive
from ingest.formats.registry import FORMATS
from omomo_core.errors import InputError, in_words
from omomo_core.whole_file import write_whole

if TYPE_CHECKING:
    from capture_app.jobs.queue import JobQueue


def find_sessions(folder: Path) -> dict[str, Path]:
    """Every folder and archive in it that is or may be a session, by a name that no other has.

    A folder that is no session but has sessions in it stands for these. One in which nothing is
    recognised is named too: its job will tell what is wrong with it. Result folders and hidden ones
    are passed over, and so are files that are no archives.

    Raises:
        InputError: "batch-missing" or "batch-empty".
    """
    if not folder.is_dir():
        raise InputError(
            "batch-missing",
            "There is no such folder of sessions.",
            where=str(folder),
            fix="Give a folder that holds sessions, or a CSV table that names them.",
        )
    logs = [path for child in sorted(folder.iterdir()) for path in _sessions(child)]
    if not logs:
        raise InputError(
            "batch-empty",
            "The folder holds no session.",
            where=str(folder),
            fix="Give a folder in which each session is a folder or an archive.",
        )
    return named(logs, folder)


def named(sessions: list[Path], folder: Path) -> dict[str, Path]:
    """Sessions by their path below a folder, written as one word; equal words get numbers."""
    names: dict[str, Path] = {}
    for session in sessions:
        inside = session.is_relative_to(folder)
        path = session.relative_to(folder) if inside else Path(session.name)
        words = path if session.is_dir() else path.with_suffix("")
        names[unused("_".join(words.parts), names)] = session
    return names


def unused(name: str, taken: dict[str, Path]) -> str:
    """The name, with the first number that makes it new."""
    numbered = (name if k == 1 else f"{name}_{k}" for k in range(1, len(taken) + 2))
    return next(candidate for candidate in numbered if candidate not in taken)


def _sessions(path: Path) -> Iterator[Path]:
    if path.name.startswith(".") or (path / MARK).is_file():
        return
    if path.is_file():
        if is_archive(path):
            yield path
    elif _is_session(path):
        yield path
    else:
        within = [child for child in sorted(path.iterdir()) if _is_session(child)]
        yield from within or [path]


def _is_session(path: Path) -> bool:
    if path.name.startswith("."):
        return False
    if path.is_file():
        return is_archive(path)
    return any(format_.detect(path) for format_ in FORMATS)


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
            fix="Find it with ‹omocap calibrate› and give ‹mount› FILE, or ‹mount› identity if the "
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
    by_id = {order_id(order): order for order in orders}
    known = {job.id for job in queue.get_all(list(by_id))}
    for id, order in by_id.items():
        if id not in known and (manifest := made_by(order)) is not None:
            queue.adopt(id, order, timings=manifest.timings, summary=summary_of(manifest))
    queue.submit_all(by_id.items())
    notes: list[str] = []
    for job in queue.get_all(list(by_id)):
        output = by_id[job.id].output
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


_FIRST = ("name", "state", "verdict", "look_at", "seconds", "sample")
_LAST = ("code", "error", "where", "fix", "session", "output", "id")


def write_results(folder: Path, jobs: Sequence[JobRecord]) -> None:
    """Write results.csv and results.json, each whole or not at all.

    Raises:
        InputError: they cannot be written.
    """
    rows = [_result_row(job) for job in jobs]
    scores = sorted({name for row in rows for name in row["scores"]})
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*_FIRST, *scores, *_LAST])
    for row in rows:
        judged = [row["scores"].get(name) for name in scores]
        writer.writerow([*(row[n] for n in _FIRST), *judged, *(row[n] for n in _LAST)])
    write_whole(folder / "results.csv", text.getvalue())
    write_whole(folder / "results.json", json.dumps(rows, indent=1) + "\n")


def _result_row(job: JobRecord) -> dict[str, Any]:
    error, sessions = job.error, [item.path for item in job.inputs if item.role == "session"]
    return {
        "name": job.name,
        "state": job.state,
        "verdict": job.summary.get("verdict"),
        "look_at": "; ".join(job.summary.get("look_at", ())),
        "seconds": round(sum(job.timings.values()), 1) if job.timings else None,
        "sample": job.summary.get("sample"),
        "scores": {k: round(v, 4) for k, v in job.summary.get("scores", {}).items()},
        "code": error and error.code,
        "error": error and in_options(error.what),
        "where": error and in_options(error.where),
        "fix": error and in_options(error.fix),
        "session": sessions[0] if sessions else None,
        "output": job.output,
        "id": job.id,
    }


_PATHS = ("session", "object", "mount", "contacts", "body", "weights")
_COLUMNS = tuple(name for name in RunRequest.model_fields if name not in ("output", "animated"))


def read_table(file: Path) -> list[dict[str, Any]]:
    """The lines of a CSV table: what is said in them about a run, by the names of `RunRequest`.

    The column `session` is needed, each other one may be there. Paths are relative to the table's
    folder. An empty cell says nothing. Lines without a name are named after their session.

    Raises:
        InputError: "batch-table-..."
    """
    try:
        with file.open(newline="", encoding="utf-8-sig") as text:
            reader = csv.DictReader(text)
            lines = [(reader.line_num, line) for line in reader]
            columns = list(reader.fieldnames or [])
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(
            "batch-table-unreadable",
            f"The table of sessions cannot be read: {in_words(error)}.",
            where=str(file),
            fix="Save it as CSV in UTF-8, with commas.",
        ) from error
    _check_columns(file, columns)
    names: dict[str, Path] = {}
    return [_table_row(file, number, line, names) for number, line in lines]


def _check_columns(file: Path, columns: list[str]) -> None:
    unknown = [name for name in columns if name not in _COLUMNS]
    if unknown or "session" not in columns:
        raise InputError(
            "batch-table-columns",
            f"The table has columns that say nothing: {', '.join(unknown)}."
            if unknown
            else "The table has no column `session`.",
            where=f"{file}, line 1",
            fix=f"Name the columns {', '.join(_COLUMNS)}: `session`, and which else you need.",
        )


def _table_row(
    file: Path, number: int, line: Mapping[str | Any, Any], names: dict[str, Path]
) -> dict[str, Any]:
    if None in line or None in line.values() or not line["session"]:
        raise InputError(
            "batch-table-line",
            "The line has not as many cells as there are columns, or names no session.",
            where=f"{file}, line {number}",
            fix="Put text with a comma in it into quotation marks.",
        )
    said: dict[str, Any] = {name: cell.strip() for name, cell in line.items() if cell.strip()}
    for name in _PATHS:
        if name in said and not (name == "mount" and said[name] == "identity"):
            said[name] = file.parent / said[name]
    options = {field: said[field] for field in TakeOptions.model_fields if field in said}
    place = f"{file}, line {number}"
    said |= validated(TakeOptions, options, "batch-option", where=place).model_dump(
        exclude_unset=True
    )
    name = unused(_word(said.get("name") or said["session"].stem), names)
    names[name] = said["session"]
    return {**said, "name": name}


def _word(name: str) -> str:
    """Fit for the name of a folder."""
    word = "".join(c if c.isalnum() or c in "-_. " else "_" for c in name).strip(". ")
    return word or "session"
