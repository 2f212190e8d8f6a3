"""Work that is done in child processes: everything that opens a session, a mesh, a mount or a result.

Each function takes paths and numbers, writes what is large into a file that appears whole, and returns
what is small as JSON. The server names these functions and never calls them, so what draws is loaded in
the children alone.
"""

import json
from base64 import b64encode
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float64

from capture_app.calibration.calibrate import by_drawing, by_points, pairs_of, write_mount
from capture_app.calibration.guide_recordings import (
    filmed_board,
    filmed_rest,
    filmed_then_clamped,
    rested_recording,
    turned_recording,
)
from capture_app.calibration.guide_steps import Finding
from capture_app.calibration.mount_look import look_at
from capture_app.commands.calibrate import DrawingWay, PointsWay
from capture_app.commands.run import ResolveRequest
from capture_app.inspection import Inspection, inspect_take, usable_take
from capture_app.report_page import report_page
from capture_app.web.page_words import all_in_page_words, in_page_words
from ingest.animated.detect import is_animation
from ingest.calibration.board.board_spec import Board, parse_board
from ingest.calibration.hand_eye.to_mount import read_pose_log
from ingest.formats.registry import check_is_session, read_session
from ingest.mesh import load_mesh
from ingest.mount import identity_mount
from ingest.mount_file import load_mount, save_mount
from ingest.report.take_report import Check
from ingest.trajectory.trajectory_config import Reading
from omomo_core.errors import InputError, OmocapError
from omomo_core.motion import FPS
from omomo_core.whole_file import whole_file, write_whole


def report_data(inspection: Inspection) -> dict[str, Any]:
    """Return what was found, as JSON."""
    times = inspection.session.times - inspection.session.times[0]
    spans = [[a / FPS, b / FPS] for a, b in inspection.take.segments] if inspection.take else []
    seconds, poses = _finite(times[-1]), len(times)
    rate = _finite(1 / np.median(np.diff(times))) if poses > 1 else None
    longest = max((b - a for a, b in spans), default=None)
    return {
        "verdict": inspection.verdict,
        "reason": inspection.reason,
        "advice": inspection.advice,
        "app": inspection.session.app,
        "seconds": seconds,
        "poses": poses,
        "rate": rate,
        "checks": [_check(check, times) for check in inspection.report.checks],
        "segments": spans,
        "floor": inspection.take.floor.message if inspection.take and inspection.mesh else "",
        "problem": inspection.problem and inspection.problem.texts,
        "facts": {
            "seconds": seconds,
            "rate": rate,
            "stretches": len(spans) if inspection.take else None,
            "longest": longest,
        },
    }


def unreadable(problem: OmocapError) -> dict[str, Any]:
    """The same of a session that cannot be read at all."""
    told = {"verdict": "not usable", "reason": problem.what, "advice": problem.fix}
    return {**_NOTHING, **told, "problem": problem.texts}


def own_motion() -> dict[str, Any]:
    """The same of an object's own motion, which no phone tracked and nobody judges."""
    return {**_NOTHING, "verdict": "not judged", "animated": True}


_NOTHING: dict[str, Any] = {
    "verdict": "",
    "reason": "",
    "advice": "",
    "app": "",
    "animated": False,
    "seconds": 0.0,
    "poses": 0,
    "rate": None,
    "checks": [],
    "segments": [],
    "floor": "",
    "problem": None,
    "facts": {"seconds": None, "rate": None, "stretches": None, "longest": None},
}


def _check(check: Check, times: Float64[np.ndarray, " poses"]) -> dict[str, Any]:
    return {
        "name": check.name,
        "severity": check.severity,
        "message": check.message,
        "fix": check.fix,
        "frames": None if check.frames is None else list(check.frames),
        "seconds": None if check.frames is None else _seconds(check.frames, times),
    }


def _seconds(frames: tuple[int, int], times: Float64[np.ndarray, " poses"]) -> list[float | None]:
    """Return the times of a stretch's first pose and of its last."""
    last = len(times) - 1
    first, stop = (min(max(k, 0), last) for k in (frames[0], frames[1] - 1))
    return [_finite(times[first]), _finite(times[stop])]


def _finite(value: float) -> float | None:
    """JSON has no NaN."""
    return round(float(value), 4) if np.isfinite(value) else None


@dataclass(frozen=True)
class SessionInputs:
    """A session with the object, the mount and the reading that a run of it would use."""

    session: Path
    mesh: Path | None
    mount: Path | None
    mounted: bool
    """A mount was chosen, if only the identity, which is no file."""
    scale: float
    reading: Reading

    def inspect(self) -> Inspection:
        """Look it over.

        Raises:
            InputError: an input cannot be read at all.
        """
        return inspect_take(
            self.session, self.mesh, self.mount, reading=self.reading, mesh_scale=self.scale
        )


def inspect(inputs: SessionInputs, data: Path) -> dict[str, Any]:
    """Write the report on a session as JSON.

    Returns:
        Its headline.

    Raises:
        InputError: an input cannot be read at all.
    """
    inspection, animated = _inspected(inputs)
    known = own_motion() if inspection is None else report_data(inspection)
    report = {**known, "animated": animated}
    write_whole(data, json.dumps(report, allow_nan=False))
    return {key: report[key] for key in ("app", "seconds", "verdict")}


def refuse_unusable(inputs: SessionInputs, force: bool, strict: bool) -> dict[str, Any]:
    """Refuse a take of a phone that a run would refuse.

    Raises:
        InputError: as `usable_take`.
    """
    usable_take(inputs.inspect(), force=force, strict=strict)
    return {}


def write_page(inputs: SessionInputs, page: Path) -> dict[str, Any]:
    """Write the report on a session as a page, with the phone on the object; none of an object's own motion.

    Raises:
        InputError: an input cannot be read at all.
    """
    from capture_app.posters import take_views

    inspection, _ = _inspected(inputs)
    if inspection is not None:
        text = report_page(inspection, take_views(inspection))
        write_whole(page, in_page_words(text, "run"))
    return {}


def _inspected(inputs: SessionInputs) -> tuple[Inspection | None, bool]:
    """What was found, None of an object's own motion; and whether a run would take it for that."""
    animated = is_animation(inputs.session, mounted=inputs.mounted)
    try:
        return inputs.inspect(), animated
    except InputError:
        if not animated:
            raise
        return None, animated


def check_session(recording: Path) -> dict[str, Any]:
    """Refuse a recording in which no reader finds one, of a phone or of an object's own motion.

    Raises:
        InputError: "session-unknown", or as `check_is_session`.
    """
    if not is_animation(recording, mounted=False):
        check_is_session(recording)
    return {}


def check_animated(session: Path, mounted: bool) -> dict[str, Any]:
    """Whether a recording is the object's own motion.

    Raises:
        InputError: as `is_animation`.
    """
    return {"animated": is_animation(session, mounted=mounted)}


def pack_session_scene(inputs: SessionInputs, scene: Path) -> dict[str, Any]:
    """Write the scene of a session.

    Raises:
        InputError: an input cannot be read at all.
    """
    from capture_app.replay.scene_pack import pack_session

    return _written(scene, pack_session(inputs.inspect(), words=_of_a_run))


def pack_object_scene(mesh: Path, scale: float, scene: Path) -> dict[str, Any]:
    """Write the scene of an object.

    Raises:
        InputError: as `load_mesh`.
    """
    from capture_app.replay.scene_pack import pack_object

    return _written(scene, pack_object(load_mesh(mesh, scale=scale)))


def pack_room_scene(source: Path, scene: Path) -> dict[str, Any]:
    """Write the scene of a room's mesh, or of the one in a session.

    Raises:
        InputError: as `room_view`.
    """
    from capture_app.replay.scene_pack import pack_object
    from ingest.scan.cut_surface import room_view

    return _written(scene, pack_object(room_view(source)))


def pack_mount_scene(mount: Path, mesh: Path, scale: float, scene: Path) -> dict[str, Any]:
    """Write the scene of a phone on its object.

    Raises:
        InputError: as `load_mount` and `load_mesh`.
    """
    from capture_app.replay.scene_pack import pack_object

    known = load_mount(mount)
    metric = load_mesh(mesh, scale=scale * known.object_scale)
    return _written(scene, pack_object(metric, known))


def pack_result_scene(result: Path, scene: Path) -> dict[str, Any]:
    """Write the scene of a result, without what the phone filmed.

    Raises:
        InputError: as `load_result`.
    """
    from capture_app.replay.scene_pack import pack_result
    from capture_app.result import load_result

    pack = pack_result(load_result(result), words=_of_a_run, film=False)
    return _written(scene, pack)


def solve_samples(result: Path, samples: tuple[int, ...]) -> dict[str, Any]:
    """Solve samples of a result, numbered from 1, and keep them in its folder.

    Raises:
        InputError: as `load_result`, or "sample-missing".
    """
    from capture_app.result import load_result, sample_index
    from capture_app.solve_samples import solved_result

    loaded = load_result(result)
    solved_result(loaded, [sample_index(loaded, number) for number in samples])
    return {}


def try_contacts(result: Path, contacts: str, sample: int | None, scene: Path) -> dict[str, Any]:
    """Write the people of a result as they are with other contacts; the result stays as it is.

    Raises:
        InputError: as `tried_correction`.
    """
    from capture_app.replay.scene_pack import pack_people
    from capture_app.resolve import tried_correction

    edited = scene.with_suffix(".json")
    write_whole(edited, contacts)
    none = scene.with_suffix(".none")
    request = ResolveRequest(output=none, result=result, contacts=edited, sample=sample)
    return _written(scene, pack_people(tried_correction(request), words=_of_a_run))


def pack_result_film(result: Path, film: Path) -> dict[str, Any]:
    """Write what the phone filmed during a result.

    Raises:
        InputError: as `load_result`.
    """
    from capture_app.replay.scene_pack import pack_film
    from capture_app.result import load_result

    return _written(film, pack_film(load_result(result)))


def share_result(result: Path, title: str, sample: int | None, page: Path) -> dict[str, Any]:
    """Write a result as one page that needs nothing else, and opens on this sample.

    Raises:
        InputError: as `load_result`, or "sample-missing".
    """
    from capture_app.replay.scene_pack import pack_result
    from capture_app.replay.share import share_page
    from capture_app.result import load_result
    from capture_app.solve_samples import all_solved

    pack = pack_result(all_solved(load_result(result)), name=title, words=_of_a_run, sample=sample)
    write_whole(page, share_page([pack], title=title))
    return {}


_of_a_run = partial(all_in_page_words, kind="run")


def _written(path: Path, content: bytes) -> dict[str, Any]:
    with whole_file(path) as partial:
        partial.write_bytes(content)
    return {}


def draw_object(mesh: Path, scale: float, poster: Path) -> dict[str, Any]:
    """Draw an object.

    Raises:
        InputError: as `load_mesh`.
    """
    from capture_app.posters import object_poster
    from ingest.mesh import load_mesh

    object_poster(poster, load_mesh(mesh, scale=scale))
    return {}


def draw_mount(mount: Path, mesh: Path, scale: float, poster: Path) -> dict[str, Any]:
    """Draw a phone on its object.

    Raises:
        InputError: as `load_mount` and `load_mesh`.
    """
    from capture_app.posters import mount_poster
    from ingest.mesh import load_mesh
    from ingest.mount_file import load_mount

    known = load_mount(mount)
    mount_poster(poster, known, load_mesh(mesh, scale=scale * known.object_scale))
    return {}


def draw_take(inputs: SessionInputs, poster: Path) -> dict[str, Any]:
    """Draw the object with the phone on it as a session moves them; an empty file where that is not known."""
    from capture_app.posters import take_poster

    try:
        drawn = take_poster(poster, inputs.inspect())
    except InputError:
        drawn = False  # the report says why the session cannot be read
    if not drawn:
        write_whole(poster, "")
    return {}


def draw_result(result: Path, poster: Path) -> dict[str, Any]:
    """Draw a result.

    Raises:
        InputError: as `load_result`.
    """
    from capture_app.posters import result_poster
    from capture_app.result import load_result

    result_poster(poster, load_result(result))
    return {}


def board_sheet(paper: str, target: Path) -> dict[str, Any]:
    """Write the PDF of the board that fills a sheet of this paper.

    Raises:
        InputError: "paper-unknown".
    """
    from ingest.calibration.board.board_sheet import preset_for, write_sheet

    with whole_file(target) as partial:
        write_sheet(preset_for(paper), paper, partial)
    return {}


Look = Literal["turned", "rested", "filmed", "still", "film", "poses"]
"""A recording that was turned about, or rests after the clamping, or shows the board before it, or
has pictures at rest; the film of a second camera; a tracker's log."""


def look(path: Path, what: Look, board: str) -> dict[str, Any]:
    """Return what a recording can be used for, and what may spoil the result.

    Args:
        path: what was recorded.
        what: the kind of look.
        board: for a look that needs the printed board.

    Raises:
        InputError: it cannot be used, with what to do better.
    """
    looks: dict[Look, Callable[[], Finding]] = {
        "turned": lambda: turned_recording(read_session(path)),
        "rested": lambda: rested_recording(read_session(path)),
        "still": lambda: filmed_rest(read_session(path)),
        "filmed": lambda: filmed_then_clamped(read_session(path), _board(board)),
        "film": lambda: filmed_board(path, _board(board)),
        "poses": lambda: _poses(path),
    }
    return looks[what]()._asdict()


def _board(text: str) -> Board:
    if not text:
        raise InputError(
            "board-needed", "Which board it is must be known first.", fix="Choose the board."
        )
    return parse_board(text)


def _poses(path: Path) -> Finding:
    times = read_pose_log(path).times
    rate, seconds = 1 / float(np.median(np.diff(times))), float(np.ptp(times))
    return Finding(f"{len(times):,} poses, {rate:.0f} a second, {seconds:.0f} s")


def identity(target: Path) -> dict[str, Any]:
    """Write the mount of a phone that is the object."""
    save_mount(identity_mount(), target)
    return {}


def look_at_mount(way: DrawingWay | PointsWay) -> dict[str, Any]:
    """Return what a mount that is still being typed implies, and the phone on the object as a scene.

    Raises:
        InputError: as `look_at` and `load_mesh`.
    """
    from capture_app.replay.scene_pack import pack_object

    file = way.mesh_file
    mesh = None if file is None else load_mesh(file.path, scale=file.scale)
    finding, mount = look_at(way, mesh)
    scene = ""
    if mesh is not None and mount is not None:
        bare = replace(mesh, faces=mesh.faces[:0], texture=None)
        scene = b64encode(pack_object(bare, mount)).decode()
    return {**finding._asdict(), "scene": scene}


def by_hand(target: Path, way: DrawingWay | PointsWay) -> dict[str, Any]:
    """Write the mount of a drawing or of points; returns how far off each of the points is.

    Raises:
        InputError: what is said does not determine the mount, or does not fit.
    """
    if isinstance(way, DrawingWay):
        mount = by_drawing(way)
        write_mount(mount, target, way.mesh_file, mount.phone, picture=None)
        return {}
    picked = by_points(way)
    write_mount(picked.mount, target, way.mesh_file, picked.mount.phone, picture=None)
    residuals = zip(pairs_of(way), picked.fit.residuals, strict=True)
    return {"points": [{"phone": pair.name, "off_mm": 1e3 * float(off)} for pair, off in residuals]}
