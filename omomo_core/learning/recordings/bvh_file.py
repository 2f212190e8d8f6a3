"""BVH files: a parser that names file and line of what is wrong, and the poses they hold."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from omomo_core.errors import InputError

_AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True)
class Bvh:
    """A skeleton and its motion, in the file's own axes."""

    names: tuple[str, ...]
    """Joints in file order; an end site is a joint named ``<parent>_end``, which turns with it."""
    parents: tuple[int, ...]
    fps: float
    joints: Float[np.ndarray, "frames joints 3"]
    """Positions, metres."""
    rotations: Float[np.ndarray, "frames joints 3 3"]
    """Global rotations; the identity is the file's rest pose (its OFFSETs)."""
    rest: Float[np.ndarray, "joints 3"]
    """Positions in the rest pose, from the root, metres."""


@dataclass
class _Joint:
    name: str
    parent: int
    offset: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    channels: list[str] = field(default_factory=list[str])


@dataclass
class _Tokens:
    """The words of a file with their line numbers, one at a time."""

    path: Path
    words: Iterator[tuple[int, str]]
    line: int = 1

    def next(self) -> str:
        try:
            self.line, word = next(self.words)
        except StopIteration:
            raise self.error("the file ends in the middle") from None
        return word

    def title(self) -> str:
        """A name, which may have spaces in it, and the brace that opens what it names."""
        parts, line = [self.next()], self.line
        while (word := self.next()) != "{":
            if self.line != line:
                raise self.error(f"expected {{, found '{word}'")
            parts.append(word)
        return " ".join(parts)

    def expect(self, *wanted: str) -> str:
        word = self.next()
        if word.upper() not in wanted:
            raise self.error(f"expected {' or '.join(wanted)}, found '{word}'")
        return word

    def number(self) -> float:
        word = self.next()
        try:
            return float(word)
        except ValueError:
            raise self.error(f"expected a number, found '{word}'") from None

    def error(self, what: str) -> InputError:
        return InputError(
            "bvh-syntax",
            f"This is not a readable BVH file: {what}.",
            where=f"{self.path}:{self.line}",
            fix="Export the motion again.",
        )


def read_bvh(path: Path, *, metres_per_unit: float) -> Bvh:
    """Parse a BVH file of any channel order into poses.

    Args:
        path: the file.
        metres_per_unit: length of one unit of the file (0.01 for centimetres); BVH does not say.

    Raises:
        InputError: ``bvh-syntax`` with file and line, ``bvh-not-finite``, ``bvh-empty``,
            ``bvh-unreadable``.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as problem:
        raise InputError("bvh-unreadable", f"{problem.strerror}.", where=str(path)) from problem
    words = ((i, word) for i, line in enumerate(lines, start=1) for word in line.split())
    tokens = _Tokens(path, words)
    skeleton = _read_hierarchy(tokens)
    tokens.expect("FRAMES:")
    frames = tokens.number()
    if frames != frames // 1:
        raise tokens.error(f"{frames:g} is no number of frames")
    tokens.expect("FRAME")
    tokens.expect("TIME:")
    frame_time = tokens.number()
    if not 0 < frame_time < np.inf:
        raise tokens.error(f"the frame time {frame_time} is not positive")
    values = _read_values(tokens, int(frames), sum(len(j.channels) for j in skeleton))
    joints, rotations = _pose(skeleton, values, metres_per_unit)
    return Bvh(
        names=tuple(j.name for j in skeleton),
        parents=tuple(j.parent for j in skeleton),
        fps=1.0 / frame_time,
        joints=joints,
        rotations=rotations,
        rest=_rest(skeleton) * metres_per_unit,
    )


def _rest(skeleton: list[_Joint]) -> Float[np.ndarray, "joints 3"]:
    rest = np.zeros((len(skeleton), 3))
    for i, joint in enumerate(skeleton):
        if joint.parent >= 0:
            rest[i] = rest[joint.parent] + joint.offset
    return rest


def _read_hierarchy(tokens: _Tokens) -> list[_Joint]:
    skeleton: list[_Joint] = []
    open_joints: list[int] = []
    tokens.expect("HIERARCHY")
    while True:
        word = tokens.next().upper()
        if word == "MOTION" and not open_joints:
            return _checked(skeleton, tokens)
        if word in ("ROOT", "JOINT", "END"):
            _open_joint(word, tokens, skeleton, open_joints)
        elif word == "}" and open_joints:
            open_joints.pop()
        elif word == "OFFSET" and open_joints:
            skeleton[open_joints[-1]].offset = [tokens.number() for _ in range(3)]
        elif word == "CHANNELS" and open_joints:
            skeleton[open_joints[-1]].channels = _channels(tokens)
        else:
            raise tokens.error(f"'{word}' does not belong here")


def _open_joint(word: str, tokens: _Tokens, skeleton: list[_Joint], open_joints: list[int]) -> None:
    parent = open_joints[-1] if open_joints else -1
    if (word == "ROOT") != (parent < 0):
        raise tokens.error(f"{word} in the wrong place")
    name = tokens.title()
    if word == "END":
        name = f"{skeleton[parent].name}_end"
    open_joints.append(len(skeleton))
    skeleton.append(_Joint(name, parent))


def _channels(tokens: _Tokens) -> list[str]:
    count = tokens.number()
    if count not in range(7):
        raise tokens.error(f"a joint cannot have {count:g} channels")
    legal = tuple(f"{axis}{kind}" for axis in "XYZ" for kind in ("POSITION", "ROTATION"))
    channels = [tokens.expect(*legal).lower() for _ in range(int(count))]
    if len(set(channels)) != len(channels):
        raise tokens.error("a channel is given twice")
    return channels


def _checked(skeleton: list[_Joint], tokens: _Tokens) -> list[_Joint]:
    names = [j.name for j in skeleton]
    if not names:
        raise tokens.error("there is no ROOT")
    if len(set(names)) != len(names):
        twice = next(n for n in names if names.count(n) > 1)
        raise tokens.error(f"the joint '{twice}' is defined twice")
    return skeleton


def _read_values(
    tokens: _Tokens, frames: int, channels: int
) -> Float[np.ndarray, "frames channels"]:
    if frames < 1 or channels < 1:
        raise InputError("bvh-empty", "The file holds no motion.", where=str(tokens.path))
    numbers = list(tokens.words)
    wanted = frames * channels
    if len(numbers) != wanted:
        tokens.line = numbers[min(wanted, len(numbers) - 1)][0] if numbers else tokens.line
        raise tokens.error(f"there are {len(numbers)} numbers, not {frames} frames of {channels}")
    values = _parsed(numbers, tokens)
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        frame, channel = divmod(int(bad[0]), channels)
        raise InputError(
            "bvh-not-finite",
            f"Channel {channel} is not a finite number.",
            where=f"{tokens.path}, frame {frame}",
            fix="Repair or leave out the clip.",
        )
    return values.reshape(frames, channels)


def _parsed(numbers: list[tuple[int, str]], tokens: _Tokens) -> Float[np.ndarray, " numbers"]:
    try:
        return np.array([word for _, word in numbers]).astype(float)
    except ValueError:
        tokens.words = iter(numbers)
        for _ in numbers:
            tokens.number()
        raise


def _pose(
    skeleton: list[_Joint], values: Float[np.ndarray, "frames channels"], metres_per_unit: float
) -> tuple[Float[np.ndarray, "frames joints 3"], Float[np.ndarray, "frames joints 3 3"]]:
    frames = len(values)
    positions = np.zeros((frames, len(skeleton), 3))
    rotations = np.zeros((frames, len(skeleton), 3, 3))
    at = 0
    for i, joint in enumerate(skeleton):
        mine = values[:, at : at + len(joint.channels)]
        at += len(joint.channels)
        offset, local = _local_pose(joint, mine)
        if joint.parent < 0:
            positions[:, i], rotations[:, i] = offset, local
            continue
        above = rotations[:, joint.parent]
        positions[:, i] = positions[:, joint.parent] + (above @ offset[:, :, None])[:, :, 0]
        rotations[:, i] = above @ local
    return positions * metres_per_unit, rotations


def _local_pose(
    joint: _Joint, values: Float[np.ndarray, "frames channels"]
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3 3"]]:
    """Offset from the parent (a position channel replaces OFFSET) and rotation relative to it."""
    offset = np.tile(np.array(joint.offset), (len(values), 1))
    order, columns = "", list[int]()
    for column, channel in enumerate(joint.channels):
        if channel.endswith("position"):
            offset[:, _AXES[channel[0]]] = values[:, column]
        else:
            order += channel[0].upper()
            columns.append(column)
    if not order:
        return offset, np.tile(np.eye(3), (len(values), 1, 1))
    return offset, Rotation.from_euler(order, values[:, columns], degrees=True).as_matrix()
