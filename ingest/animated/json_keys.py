"""Keyframes in JSON: {"fps": 24, "up": "z", "interpolation": "bezier", "keyframes": [...]}.

A keyframe is {"frame": 1 (or "time": seconds), "position": [x, y, z], "quaternion": [x, y, z, w]},
optionally with an "interpolation" of its own, and with "handle_left" and "handle_right":
{"position": [[frame or time, value] x 3], "quaternion": [[frame or time, value] x 4]}.
"""

from pathlib import Path
from typing import Annotated

import numpy as np
from jaxtyping import Float64
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from ingest.animated.animation import MAX_FPS, Animation, Up
from ingest.animated.curves import Mode
from ingest.animated.keyframes import Keyframes, animate
from ingest.formats.json_file import mentions
from omomo_core import strict_json
from omomo_core.errors import InputError

NAME = "JSON"
FILES = 'keyframes as JSON with a list "keyframes"'


def _small(word: object) -> object:
    return word.lower() if isinstance(word, str) else word


_Number = Annotated[float, Field(allow_inf_nan=False)]
_Four = tuple[_Number, _Number, _Number, _Number]
_Three = tuple[_Number, _Number, _Number]
_Point = tuple[_Number, _Number]
_Mode = Annotated[Mode, BeforeValidator(_small)]


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class _Handle(_Record):
    position: tuple[_Point, _Point, _Point]
    quaternion: tuple[_Point, _Point, _Point, _Point]

    def points(self) -> list[_Point]:
        return [*self.position, *self.quaternion]


class _Key(_Record):
    frame: _Number | None = None
    time: _Number | None = None
    position: _Three
    quaternion: _Four
    interpolation: _Mode | None = None
    handle_left: _Handle | None = None
    handle_right: _Handle | None = None


class _File(_Record):
    fps: Annotated[float, Field(gt=0, lt=MAX_FPS)] | None = None
    up: Annotated[Up, BeforeValidator(_small)] = "z"
    interpolation: _Mode = "bezier"
    keyframes: tuple[_Key, ...]


def detect(path: Path) -> bool:
    """Whether it begins like a JSON object and has "keyframes"."""
    return mentions(path, "keyframes")


def read(path: Path) -> Animation:
    """Read keyframes and interpolate them at 30 fps.

    Raises:
        InputError: "keyframes-damaged", "fps-missing", "keyframes-clock" or "keyframes-handles";
            besides those of `animate`.
    """
    try:
        file = _File.model_validate(strict_json.parse(path.read_bytes()))
    except ValueError as problem:
        raise _damaged(path, problem) from None
    frames = [key.frame for key in file.keyframes if key.time is None]
    counted = 0 < len(frames) == len(file.keyframes)
    stamps = frames if counted else [k.time for k in file.keyframes if k.frame is None]
    known = [stamp for stamp in stamps if stamp is not None]
    if len(known) < len(file.keyframes):
        raise InputError(
            "keyframes-clock",
            'Some keyframes have neither "frame" nor "time", both, or not the same as the others.',
            where=str(path),
            fix="Give all of them frames, or all of them times in seconds.",
        )
    rate = _rate(file, path) if counted else 1.0
    handles = _handles(file.keyframes, path)
    if handles is not None:
        handles[..., 0] /= rate
    return animate(
        Keyframes(
            source=path,
            times=np.array(known, np.float64) / rate,
            positions=np.array([k.position for k in file.keyframes], np.float64).reshape(-1, 3),
            xyzw=np.array([k.quaternion for k in file.keyframes], np.float64).reshape(-1, 4),
            modes=tuple(k.interpolation or file.interpolation for k in file.keyframes),
            up=file.up,
            places=tuple(f"{path}, keyframe {i + 1}" for i in range(len(file.keyframes))),
            handles=handles,
        )
    )


def _rate(file: _File, path: Path) -> float:
    if file.fps is None:
        raise InputError(
            "fps-missing",
            f"{path.name} counts frames, and does not say how many are a second.",
            where=str(path),
            fix='Add "fps": 24 (what the scene has), or give "time" in seconds.',
        )
    return file.fps


def _handles(keys: tuple[_Key, ...], path: Path) -> Float64[np.ndarray, "keys 7 2 2"] | None:
    given = [h for key in keys for h in (key.handle_left, key.handle_right) if h is not None]
    if not given:
        return None
    if len(given) < 2 * len(keys):
        raise InputError(
            "keyframes-handles",
            "Some Bezier handles are given and some are not.",
            where=str(path),
            fix="Give both handles of every keyframe, or none: then they are auto-clamped.",
        )
    points = np.array([handle.points() for handle in given], np.float64)
    return points.reshape(len(keys), 2, 7, 2).swapaxes(1, 2).copy()


def _damaged(path: Path, problem: ValueError) -> InputError:
    place, what = "", str(problem)
    if isinstance(problem, ValidationError):
        error = problem.errors(include_url=False, include_input=False)[0]
        place, what = ".".join(str(part) for part in error["loc"]), error["msg"]
    return InputError(
        "keyframes-damaged",
        f"{path.name} is not what it should be: {place + ': ' if place else ''}{what}.",
        where=f"{path}, {place}" if place else str(path),
        fix='Write {"fps": 24, "up": "z", "interpolation": "bezier", "keyframes": [{"frame": 1, '
        '"position": [x, y, z], "quaternion": [x, y, z, w]}, ...]}.',
    )
