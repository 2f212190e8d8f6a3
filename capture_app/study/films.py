"""The films of a study: every method's motion of a take from one camera, and broken ones."""

import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from capture_app.comparison.arrange import placed_motions
from capture_app.comparison.choice import Choice
from capture_app.comparison.load import load_motions
from capture_app.comparison.motion import Motion, stretch
from capture_app.study.design import Page
from capture_app.study.methods import Method
from omomo_core.errors import InputError
from omomo_core.motion import FPS, HumanMotion
from render.backends import Backend
from render.comparison import Contender, views
from render.strips import Picture
from render.video import write_video

_SHORTEST = 1.0
"""Seconds that all methods of a take must have in common."""
_BLOCK = 6
"""Frames that stay together when a motion is shuffled."""
_FAR = 0.5
"""Metres that an object must go for a person who stands still to look wrong."""

Film = tuple[str, str, bool]
"""Take, method, and whether it is broken."""


@dataclass(frozen=True)
class FilmStyle:
    """How films look."""

    width: int = 360
    height: int = 300
    seconds: float = 6.0
    """Longest film: the stretch in which the object moves most."""
    crf: int = 27
    """Quality of the video; higher is smaller."""
    backend: Backend = "auto"


def films_of(pages: Sequence[Page]) -> list[Film]:
    """The films that pages show, sorted."""
    shown: set[Film] = set()
    for item in (item for page in pages for item in page.items):
        q = item.question
        shown |= {(q.take, q.first, False), (q.take, q.second, item.intact is not None)}
    return sorted(shown)


def make_films(
    films: Sequence[Film],
    methods: Sequence[Method],
    style: FilmStyle,
    progress: Callable[[float], None],
) -> dict[Film, bytes]:
    """Draw films as MP4: those of a take have one camera, one clock and one length.

    Raises:
        InputError: a motion cannot be read, moves another object than the same take of another
            method, or has less than a second in common with it.
    """
    made: dict[Film, bytes] = {}
    takes = sorted({take for take, *_ in films})
    for k, take in enumerate(takes):
        wanted = [film for film in films if film[0] == take]
        motions = _motions(take, methods, style.seconds)
        made |= _filmed(wanted, motions, k, style)
        progress((k + 1) / len(takes))
    return made


def broken(motion: Motion, seed: int) -> Motion:
    """The same object with a person nobody can take for real.

    They stand still while the object moves (even seeds, where it moves far enough to be seen), or
    their moments come in disorder.
    """
    frames = len(motion.human.root)
    far = float(np.ptp(motion.object_motion.T_world_object[:, :3, 3], axis=0).max())
    if seed % 2 == 0 and far > _FAR:
        order = np.zeros(frames, int)
    else:
        blocks = np.array_split(np.arange(frames), max(2, frames // _BLOCK))
        mixed = np.random.default_rng(seed).permutation(len(blocks))
        order = np.concatenate([blocks[k] for k in mixed])
    human = HumanMotion(
        **{k: getattr(motion.human, k)[order] for k in HumanMotion.__dataclass_fields__}
    )
    return replace(motion, human=human)


def _motions(take: str, methods: Sequence[Method], seconds: float) -> dict[str, Motion]:
    """The take by each method, in one world, cut to the same frames."""
    chosen = [Choice(m.takes[take]) for m in methods]
    placed = placed_motions(load_motions(chosen))
    start = max(p.placement.begin for p in placed)
    stop = min(p.placement.begin + len(p.motion.human.root) for p in placed)
    if stop - start < _SHORTEST * FPS:
        raise InputError(
            "study-take-short",
            f"The methods have {max(0, stop - start) / FPS:.1f} s of this take in common.",
            where=take,
            fix="Take it out of the folders, or make all its results from the same recording.",
        )
    first, last = _liveliest(placed[0].motion, start, stop, round(seconds * FPS))
    return {
        m.name: stretch(p.motion, first - p.placement.begin, last - p.placement.begin)
        for m, p in zip(methods, placed, strict=True)
    }


def _liveliest(motion: Motion, start: int, stop: int, frames: int) -> tuple[int, int]:
    """The stretch of at most so many frames in which the object goes farthest."""
    if stop - start <= frames:
        return start, stop
    path = motion.object_motion.T_world_object[start:stop, :3, 3]
    way = np.concatenate([[0.0], np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum()])
    first = start + int(np.argmax(way[frames - 1 :] - way[: len(way) - frames + 1]))
    return first, first + frames


def _filmed(
    wanted: Sequence[Film], motions: Mapping[str, Motion], seed: int, style: FilmStyle
) -> dict[Film, bytes]:
    # All methods are filmed, so that the camera does not depend on which of them a pair needs.
    cast = [(method, False) for method in motions]
    cast += [(method, True) for _, method, ruined in wanted if ruined]
    contenders = [
        _contender(broken(motions[method], seed + k) if ruined else motions[method])
        for k, (method, ruined) in enumerate(cast)
    ]
    pictures = views(
        contenders,
        range(len(contenders[0].human.root)),
        width=style.width,
        height=style.height,
        markers=False,
        time_code=False,
        backend=style.backend,
        samples=4,
    )
    columns = list(zip(*pictures, strict=True))
    take = wanted[0][0]
    return {
        (take, *role): _encoded(list(column), style.crf)
        for role, column in zip(cast, columns, strict=True)
        if (take, *role) in wanted
    }


def _contender(motion: Motion) -> Contender:
    """Recorded people look like all others."""
    return Contender(
        "", motion.human, motion.object_motion, motion.body, motion.contact, truth=False
    )


def _encoded(pictures: Sequence[Picture], crf: int) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        write_video(path, pictures, FPS, crf=crf)
        return path.read_bytes()
