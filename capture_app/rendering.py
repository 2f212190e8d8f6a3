"""A result drawn again as a video or picture: times, sizes and endings."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from capture_app.commands.render import RenderRequest
from capture_app.exports.resample import Sampled
from capture_app.overlay.aligned import eye_of
from capture_app.progress import Progress, silent
from capture_app.result import Result, body_of, load_result, sample_index
from capture_app.solve_samples import solved_result
from omomo_core.errors import InputError
from omomo_core.motion import FPS, HumanMotion
from omomo_core.whole_file import check_target
from render.lettering import Picture
from render.props import Actor
from render.third_person import frames, held_places
from render.video import contact_sheet, write_moving, write_png
from render.views import shot

SMALL = (".webp", ".gif")
"""Loops for web pages: they have half as many pictures a second as a video."""
MOVING = (".mp4", *SMALL)


def stride(path: Path) -> int:
    """Frames of the motion from one picture of a file to its next."""
    return 2 if path.suffix in SMALL else 1


def frame_at(seconds: float, count: int) -> int:
    """The frame that is shown at a time.

    Raises:
        InputError: ``time-outside``.
    """
    frame = round(seconds * FPS)
    if not 0 <= frame < count:
        raise InputError(
            "time-outside",
            f"There is no picture at {seconds:g} s: the motion lasts {count / FPS:.2f} s.",
            field="still",
            fix="Give a time within the motion.",
        )
    return frame


def with_progress(pictures: Iterator[Picture], count: int, progress: Progress) -> Iterator[Picture]:
    """Yield the pictures, and report the fraction that has gone by as progress of the stage "video"."""
    for k, picture in enumerate(pictures):
        yield picture
        progress("video", (k + 1) / count)


def save_pictures(path: Path, pictures: Iterator[Picture]) -> None:
    """Write pictures as the file's ending says: a .png the first, others all, at their stride.

    Raises:
        InputError: the file cannot be written.
    """
    if path.suffix == ".png":
        write_png(path, next(pictures))
    else:
        write_moving(path, pictures, FPS / stride(path))


def render_result(request: RenderRequest, progress: Progress = silent) -> None:
    """Draw it into a file that appears whole or not at all.

    Args:
        request: what to draw.
        progress: told the stage "video".

    Raises:
        InputError: the result cannot be read or has no such sample or time, or the file cannot be
            written.
    """
    loaded = load_result(request.result)
    index = sample_index(loaded, request.sample)
    loaded = solved_result(loaded, [index], progress)
    check_target(request.output, (".png",) if request.picture else MOVING)
    order = _order(request, len(loaded.object_motion.valid))
    person, moved = loaded.people[index], loaded.object_motion
    eye = eye_of(loaded) if request.view == "object" else None
    view = shot(request.view, person.human, moved, *request.size, eye)
    # Close to the hands markers would hide them.
    markers = request.markers and request.view != "hands"
    held = held_places(person.segments, moved) if markers else ()
    pictures = frames(
        person.human,
        moved,
        body_of(loaded),
        width=request.size[0],
        height=request.size[1],
        cameras=view.cameras,
        markers=markers,
        extra=[*held, *view.tracks],
        pixels_per_metre=view.pixels_per_metre,
        samples=4 if (request.picture if request.smooth is None else request.smooth) else 0,
        backend=request.backend,
        only=order,
        instead=_robot(request, person.human, loaded),
    )
    drawn = with_progress(pictures, len(order), progress)
    if request.picture:
        columns = request.sheet[0] if request.sheet else 1
        drawn = iter([contact_sheet(list(drawn), columns)])
    save_pictures(request.output, drawn)


def _robot(request: RenderRequest, human: HumanMotion, result: Result) -> list[Actor]:
    """Return the robot that is drawn in place of the person; nothing if none is asked for."""
    if request.robot is None:
        return []
    from capture_app.robots.robot_film import robot_actors
    from capture_app.robots.robot_model import load_robot
    from capture_app.robots.robot_solver import robot_motion

    robot = load_robot(request.robot, request.frames)
    sampled = Sampled(human, result.object_motion, FPS)
    return robot_actors(robot_motion(robot, sampled, body_of(result)))


def _order(request: RenderRequest, count: int) -> Sequence[int]:
    """The frames to draw."""
    if request.still is not None and request.sheet is not None:
        raise InputError(
            "sheet-and-still",
            "One picture and a sheet of them cannot be one file.",
            where="‹still›, ‹sheet›",
            fix="Give one of the two.",
        )
    if request.still is not None:
        return [frame_at(request.still, count)]
    if request.sheet is not None:
        pictures = request.sheet[0] * request.sheet[1]
        return [round(k * (count - 1) / max(pictures - 1, 1)) for k in range(pictures)]
    return range(0, count, stride(request.output))
