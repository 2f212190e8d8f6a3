"""Several motions seen by one camera on one clock, and the heat of their differences."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32
from scipy.spatial import KDTree

from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.motion import FPS, HumanMotion, ObjectMotion
from render import lettering
from render.backends import Backend, open_renderer
from render.cameras import Camera, follow
from render.lettering import DARK, Held, Picture, text_width, write
from render.props import BODY_COLOR, Actor, floor
from render.renderer import Renderer
from render.scene import Color, Light, Scene
from render.third_person import facing, object_corners, stage, subject

HEAT_BODY: Color = (0.90, 0.90, 0.90)
"""A body that is to be tinted is drawn in this colour."""
_STOPS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
_COLORS = np.array(
    [
        [0.93, 0.94, 0.95],
        [1.0, 0.86, 0.45],
        [0.98, 0.58, 0.22],
        [0.84, 0.20, 0.16],
        [0.42, 0.03, 0.18],
    ]
)
"""From pale through yellow and red to dark: lighter is always nearer, also without colours."""
_ROUND = (0.02, 0.05, 0.10, 0.15, 0.20, 0.30, 0.40, 0.60, 0.80, 1.0, 1.5, 2.0)
"""Metres that a scale may end at."""
_NEIGHBOURS = 3


def heat_color(share: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n 3"]:
    """Colours from 0 (no distance) to 1 (the end of the scale, and beyond), each 0 to 1."""
    return np.stack([np.interp(share, _STOPS, _COLORS[:, k]) for k in range(3)], axis=-1)


def heat_scale(distances: Iterable[Float[np.ndarray, "..."]]) -> float:
    """A round end of the scale, metres, that 95 % of some distances stay below."""
    every = np.concatenate([d.ravel() for d in distances])
    most = float(np.quantile(every, 0.95)) if len(every) else 0.0
    return next((end for end in _ROUND if end >= most), _ROUND[-1])


def tinted(
    with_body: tuple[Picture, Float32[np.ndarray, "h w"]],
    without: Float32[np.ndarray, "h w"],
    camera: Camera,
    vertices: Float[np.ndarray, "verts 3"],
    distance: Float[np.ndarray, " verts"],
    scale: float,
) -> Picture:
    """The picture with the body in its heat; what stands before the body keeps its colour.

    Args:
        with_body: colours and depth of the scene, its body drawn in `HEAT_BODY`.
        without: depth of the same scene without the body.
        camera: both were drawn from.
        vertices: the body's, world, metres.
        distance: of each vertex from the other body's, metres.
        scale: metres at the end of the scale.
    """
    rgb, depth = with_body
    body = (depth > 0) & ((without == 0) | (depth < without - 1e-3))
    if not body.any():
        return rgb
    points = _world_points(camera, depth, body)
    far, near = KDTree(vertices).query(points, k=_NEIGHBOURS)
    weight = 1.0 / np.maximum(far, 1e-4)
    value = (weight * distance[near]).sum(axis=1) / weight.sum(axis=1)
    tint = np.zeros((*body.shape, 3), np.float32)
    tint[body] = heat_color(value / scale) / HEAT_BODY
    # Pixels on the body's outline are partly background: they are tinted in part.
    share = cv2.blur(body.astype(np.float32), (3, 3))[..., None]
    spread = cv2.blur(tint, (3, 3)) / np.maximum(share, 1e-6)
    share = np.where(body[..., None], 1.0, 0.5 * share)
    tint = np.where(body[..., None], tint, spread)
    out = rgb * (1.0 - share + share * tint)
    return np.clip(out, 0.0, 255.0).astype(np.uint8)


def heat_legend(picture: Picture, words: str, scale: float, unit: float) -> None:
    """Draw the scale with its ends in centimetres into the middle of a picture, in place."""
    h, w = picture.shape[:2]
    long, thick = round(9 * unit), round(0.8 * unit)
    ends = ("0", f"{100 * scale:g} cm")
    widths = [text_width(t, unit) + 0.6 * unit for t in (words, *ends)]
    x = 0.5 * (w - sum(widths) - long - 0.8 * unit)
    write(picture, words, (x, h / 2), unit, ink=DARK)
    x += widths[0] + 0.8 * unit
    write(picture, ends[0], (x, h / 2), unit, ink=DARK)
    left, top = round(x + widths[1]), (h - thick) // 2
    bar = 255 * heat_color(np.linspace(0.0, 1.0, long))
    picture[top : top + thick, left : left + long] = bar.astype(np.uint8)
    cv2.rectangle(picture, (left, top), (left + long, top + thick), (170, 170, 172), 1)
    write(picture, ends[1], (left + long + 0.6 * unit, h / 2), unit, ink=DARK)


def _world_points(
    camera: Camera, depth: Float32[np.ndarray, "h w"], where: np.ndarray
) -> Float[np.ndarray, "pixels 3"]:
    """World points that pixels show."""
    v, u = np.nonzero(where)
    d = depth[where].astype(np.float64)
    rays = np.stack([(u - camera.cx) / camera.fx * d, (camera.cy - v) / camera.fy * d, -d], axis=1)
    return rays @ camera.T_world_camera[:3, :3].T + camera.T_world_camera[:3, 3]


TRUTH_COLOR: Color = (0.66, 0.67, 0.69)


@dataclass(frozen=True)
class Number:
    """A measured figure as it is shown under a picture."""

    name: str
    value: str
    best: bool = False
    """Nothing else in the comparison has a better one."""


@dataclass(frozen=True)
class Contender:
    """One motion of a comparison, in the world that all of them share."""

    label: str
    human: HumanMotion
    object_motion: ObjectMotion
    body: BodyModel
    contact: Bool[np.ndarray, "frames 2"]
    """When the left, right hand holds the object."""
    begin: int = 0
    """Its first frame on the common clock."""
    truth: bool = False
    """A recorded person."""
    reference: Held | None = None
    """The contacts of the recorded person of the same take."""
    numbers: tuple[Number, ...] = ()

    @property
    def held(self) -> Held:
        """Its contacts on the common clock."""
        return Held(self.contact, self.begin)

    def frame(self, tick: int) -> int:
        """Its frame at a tick of the common clock; the first before, the last after it."""
        return min(max(tick - self.begin, 0), len(self.human.root) - 1)

    def lasts(self, tick: int) -> bool:
        """Whether it has begun and not ended."""
        return 0 <= tick - self.begin < len(self.human.root)


def clock(contenders: Sequence[Contender]) -> int:
    """Frames from the first tick, 0, until all have ended."""
    return max(c.begin + len(c.human.root) for c in contenders)


def shared_camera(contenders: Sequence[Contender], width: int, height: int) -> list[Camera]:
    """A camera per tick that follows and keeps every contender and their objects in view."""
    ticks = range(clock(contenders))
    parts = [(c, np.array([c.frame(t) for t in ticks])) for c in contenders]
    return follow(
        np.concatenate([_subject_points(c)[at] for c, at in parts], axis=1),
        np.mean([c.human.root[at, :2] for c, at in parts], axis=0),
        facing(contenders[0].human)[parts[0][1]],
        np.mean([object_corners(c.object_motion)[at, :, :2].mean(axis=1) for c, at in parts], 0),
        width,
        height,
    )


def views(
    contenders: Sequence[Contender],
    ticks: Sequence[int],
    *,
    width: int,
    height: int,
    heat: float | None = None,
    markers: bool = True,
    time_code: bool = True,
    backend: Backend = "auto",
    samples: int = 0,
) -> Iterator[list[Picture]]:
    """Yield a picture of every contender alone for each tick, all from the same camera.

    Args:
        contenders: in one world, on one clock.
        ticks: which of the clock's frames to draw.
        width, height: of each picture, pixels.
        heat: colour bodies by their distance from the first one, up to so many metres (see
            `difference_scale`).
        markers: draw palms' contacts and the object's trail.
        time_code: write the time on each picture.
        backend, samples: see `open_renderer`.
    """
    cameras = shared_camera(contenders, width, height)
    casts = [_cast(k, c, markers=markers) for k, c in enumerate(contenders)]
    scene = Scene(
        [_ground(contenders), *(a.drawable for cast in casts for a in cast)],
        light=_key_light(cameras[0]),
    )
    with open_renderer(width, height, backend, samples=samples) as renderer:
        renderer.show(scene)
        _hide(renderer, [a for cast in casts for a in cast])
        for tick in ticks:
            alone = _alone(renderer, contenders, casts, tick, cameras[tick], heat)
            pictures = [
                np.array(picture) if c.lasts(tick) else _faded(picture)
                for c, picture in zip(contenders, alone, strict=True)
            ]
            for picture in pictures if time_code else ():
                size = max(10.0, height / 24)
                write(picture, lettering.time_code(tick / FPS), (size, height - 1.2 * size), size)
            yield pictures


def difference_scale(contenders: Sequence[Contender]) -> float:
    """Metres at the end of the scale of heat: round, and rarely exceeded.

    Raises:
        InputError: the bodies have different meshes, so that no point corresponds.
    """
    first = contenders[0]
    for other in contenders[1:]:
        if other.body.faces.shape != first.body.faces.shape:
            raise InputError(
                "heat-bodies-differ",
                "Heat needs the same body mesh in all motions.",
                where=other.label,
                fix="Compare results on the same body, or leave ‹heat› out.",
            )
    ticks = range(clock(contenders))
    return heat_scale(
        np.linalg.norm(
            np.stack(
                [c.human.joints[c.frame(t)] - first.human.joints[first.frame(t)] for t in ticks]
            ),
            axis=-1,
        )
        for c in contenders[1:]
    )


def _alone(
    renderer: Renderer,
    contenders: Sequence[Contender],
    casts: Sequence[Sequence[Actor]],
    tick: int,
    camera: Camera,
    heat: float | None,
) -> Iterator[Picture]:
    """The contenders at a tick, one by one; the renderer shows none of them afterwards."""
    for k, (contender, cast) in enumerate(zip(contenders, casts, strict=True)):
        for actor in cast:
            actor.pose(renderer, contender.frame(tick))
            renderer.update(actor.drawable.name, visible=True)
        body = cast[0].drawable.name
        if heat is None or k == 0:
            yield renderer.color(camera)
        else:
            renderer.update(body, color=np.array(HEAT_BODY))
            drawn = renderer.draw(camera)
            renderer.update(body, visible=False)
            behind = renderer.draw(camera)[1]
            here = _skin(cast, contender.frame(tick))
            away = np.linalg.norm(here - _skin(casts[0], contenders[0].frame(tick)), axis=1)
            yield tinted(drawn, behind, camera, here, away, heat)
        _hide(renderer, cast)


def _skin(cast: Sequence[Actor], frame: int) -> Float[np.ndarray, "verts 3"]:
    moves = cast[0].vertices
    assert moves is not None
    return moves(frame)


def _cast(k: int, contender: Contender, *, markers: bool) -> list[Actor]:
    """The actors of one contender, its body first, under names of their own."""
    actors = stage(contender.human, contender.object_motion, contender.body, markers=markers)
    body = TRUTH_COLOR if contender.truth else BODY_COLOR
    return [
        replace(
            a,
            drawable=replace(
                a.drawable,
                name=f"{k} {a.drawable.name}",
                color=body if i == 0 else a.drawable.color,
            ),
        )
        for i, a in enumerate(actors)
    ]


def _hide(renderer: Renderer, actors: Sequence[Actor]) -> None:
    for actor in actors:
        renderer.update(actor.drawable.name, visible=False)


def _faded(picture: Picture) -> Picture:
    pale = np.array(Scene(()).background) * 255.0
    return (0.35 * picture + 0.65 * pale).astype(np.uint8)


def _subject_points(contender: Contender) -> Float[np.ndarray, "frames points 3"]:
    return subject(contender.human, contender.object_motion)


def _ground(contenders: Sequence[Contender]):
    used = np.concatenate([_subject_points(c)[..., :2].reshape(-1, 2) for c in contenders])
    return floor(used.min(axis=0), used.max(axis=0))


def _key_light(camera: Camera) -> Light:
    """The sun over the shoulder of the first camera, to its left."""
    toward = camera.T_world_camera[:3, 2]
    return Light(azimuth=float(np.arctan2(toward[1], toward[0])) - 0.9)
