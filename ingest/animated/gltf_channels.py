"""Animated transforms of glTF nodes (glTF 2.0, section 3.11 and appendix C)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from pygltflib import GLTF2, AnimationSampler
from scipy.spatial.transform import Rotation, Slerp

from ingest.animated.gltf_file import GltfFile
from ingest.animated.keyframes import last_key
from ingest.animated.poses import check_times
from ingest.animated.quaternions import checked
from ingest.animated.rows import not_finite
from omomo_core.errors import InputError

REST = {"translation": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 1.0, 1.0]}
"""What a node has where nothing else is said."""


@dataclass(frozen=True)
class Channel:
    """One property of one node over time."""

    path: str
    """translation, rotation or scale."""
    interpolation: str
    times: Float64[np.ndarray, " keys"]
    values: Float64[np.ndarray, "keys parts components"]
    """One part a key; in-tangent, value and out-tangent for CUBICSPLINE."""

    def at(self, times: Float64[np.ndarray, " frames"]) -> Float64[np.ndarray, "frames components"]:
        """The property at the wanted times; before the first and after the last key it is held."""
        clock, keys = self.times, self.values[:, self.values.shape[1] // 2]
        times = times.clip(clock[0], clock[-1])
        if len(clock) == 1:
            return np.repeat(keys, len(times), axis=0)
        k = last_key(clock, times)
        if self.interpolation == "STEP":
            return keys[k]
        k = k.clip(0, len(clock) - 2)
        if self.interpolation == "CUBICSPLINE":
            return self._cubic(times, k)
        if self.path == "rotation":
            return Slerp(clock, Rotation.from_quat(keys))(times).as_quat()
        u = ((times - clock[k]) / (clock[k + 1] - clock[k]))[:, None]
        return keys[k] + u * (keys[k + 1] - keys[k])

    def _cubic(
        self, times: Float64[np.ndarray, " frames"], k: np.ndarray
    ) -> Float64[np.ndarray, "frames components"]:
        step = (self.times[k + 1] - self.times[k])[:, None]
        u = (times - self.times[k])[:, None] / step
        before, after = self.values[k], self.values[k + 1]
        return (
            (2 * u**3 - 3 * u**2 + 1) * before[:, 1]
            + step * (u**3 - 2 * u**2 + u) * before[:, 2]
            + (3 * u**2 - 2 * u**3) * after[:, 1]
            + step * (u**3 - u**2) * after[:, 0]
        )


def movers(gltf: GLTF2) -> dict[int, set[int]]:
    """The animations (by number) that move, turn or scale each node."""
    found: dict[int, set[int]] = {}
    for number, animation in enumerate(gltf.animations):
        for channel in animation.channels:
            node = channel.target.node
            if node is not None and channel.target.path in REST:
                found.setdefault(node, set()).add(number)
    return found


def channels(file: GltfFile, number: int, node: int) -> tuple[Channel, ...]:
    """The channels of one animation that move one node.

    Raises:
        InputError: "time-backwards", "pose-not-finite" or "gltf-keys".
    """
    animation = file.gltf.animations[number]
    return tuple(
        _channel(file, channel.target.path, animation.samplers[channel.sampler], node)
        for channel in animation.channels
        if channel.target.node == node and channel.target.path in REST
    )


def _channel(file: GltfFile, path: str, sampler: AnimationSampler, node: int) -> Channel:
    name = f"{file.source}, {path} of node {file.gltf.nodes[node].name or node}"
    times = file.array(sampler.input)[:, 0].astype(np.float64)
    raw = file.array(sampler.output).astype(np.float64)
    parts = 3 if sampler.interpolation == "CUBICSPLINE" else 1
    width = len(REST[path])
    if raw.shape != (len(times) * parts, width) or len(times) == 0:
        raise InputError(
            "gltf-keys",
            f"There are {len(times)} times and {len(raw)} values of {raw.shape[1]} numbers.",
            where=name,
            fix="Export the animation again.",
        )
    values = raw.reshape(len(times), parts, width)
    finite = np.isfinite(times) & np.isfinite(values).all(axis=(1, 2))
    if not finite.all():
        raise not_finite(f"{name}, key {int(np.argmin(finite))}")
    if len(times) > 1:
        check_times(times, lambda key: f"{name}, key {key}", file.source)
    if path == "rotation":
        checked(values[:, parts // 2], lambda key: f"{name}, key {key}")
    return Channel(path, sampler.interpolation or "LINEAR", times, values)
