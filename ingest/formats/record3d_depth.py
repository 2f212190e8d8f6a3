"""Depth of Record3D: float32 metres in portrait, compressed with Apple's LZFSE.

Decompressing needs the optional package pyliblzfse; without it a recording has no depth.
"""

import importlib
from functools import partial
from pathlib import Path
from typing import Protocol, cast, runtime_checkable

import numpy as np
from jaxtyping import Float32, Float64

from ingest.formats.json_file import JsonObject, member, number_at, place
from ingest.formats.pictures import file_inside, stills
from ingest.session import DepthLog
from omomo_core.errors import InputError

_MAX_SIDE = 640
"""The larger side of Face ID's depth; LiDAR has 256."""

_FIX = "Export the recording from the app again."


@runtime_checkable
class Lzfse(Protocol):
    """The part of the package pyliblzfse that is used."""

    error: type[Exception]

    def decompress(self, data: bytes, /) -> bytes:
        """The bytes that were compressed."""
        ...


def lzfse_depth(
    values: JsonObject, times: Float64[np.ndarray, " frames"], log: Path
) -> DepthLog | None:
    """The maps rgbd/<i>.depth; None where there are none, or nothing to decompress them with.

    Args:
        values: the metadata, with the size `dw` x `dh`.
        times: of the frames, seconds.
        log: the metadata file.
    """
    lzfse = _package()
    names = [f"rgbd/{i}.depth" for i in range(len(times))]
    maps, map_times = stills(times, [file_inside(log.parent, name) for name in names])
    if lzfse is None or maps is None or map_times is None:
        return None
    sides = [number_at(member(values, key, log), log, key) for key in ("dw", "dh")]
    if not all(1 <= side <= _MAX_SIDE for side in sides):
        what = f"Depth of {sides[0]:g} x {sides[1]:g} pixels is no phone's."
        raise InputError("depth-damaged", what, where=place(log, "dw, dh"), fix=_FIX)
    # As with w and h, converted files have them the wrong way round: the maps are portrait.
    shape = int(max(sides)), int(min(sides))
    return DepthLog(map_times, maps, partial(_load, shape=shape, lzfse=lzfse))


def _package() -> Lzfse | None:
    try:
        return cast(Lzfse, importlib.import_module("liblzfse"))
    except ImportError:
        return None


def _load(
    file: Path, *, shape: tuple[int, int], lzfse: Lzfse
) -> Float32[np.ndarray, "height width"]:
    size = 4 * shape[0] * shape[1]
    if file.stat().st_size > size + 1024:
        raise _damaged(file, f"it is larger than a map of {size} bytes")
    try:
        raw = lzfse.decompress(file.read_bytes())
    except lzfse.error as error:
        raise _damaged(file, "it cannot be decompressed") from error
    if len(raw) != size:
        raise _damaged(file, f"it has {len(raw)} bytes instead of {size}")
    metres = np.frombuffer(raw, dtype="<f4").reshape(shape)
    return np.where(np.isfinite(metres), metres, np.float32(0))


def _damaged(file: Path, why: str) -> InputError:
    what = f"The depth map {file.name} is damaged: {why}."
    return InputError("depth-damaged", what, where=str(file), fix=_FIX)
