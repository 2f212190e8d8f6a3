"""glTF 2.0 files as their JSON and what it names: buffers, views, accessors; and extensions by name."""

import base64
import json
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import numpy as np

from ingest.mesh_files.gltf_compression import DRACO, MESHOPT, unpacked_view
from omomo_core.errors import DamageError, InputError

MAX_COUNT = 20_000_000
"""Elements of one accessor."""
_MOST_READ = 300_000_000
"""Numbers of all accessors together: several may name the same bytes."""
_MOST_BESIDE = 500 * 10**6
"""Bytes of a file beside it."""
_DTYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_GLB_HEAD, _CHUNK_HEAD = 12, 8
_JSON_CHUNK, _BINARY_CHUNK = b"JSON", b"BIN\0"

READ = frozenset(
    {
        *MESHOPT, DRACO, "EXT_mesh_gpu_instancing", "KHR_mesh_quantization", "KHR_texture_transform",
        "KHR_node_visibility", "KHR_materials_variants", "KHR_materials_pbrSpecularGlossiness",
        "KHR_texture_basisu", "EXT_texture_webp", "EXT_texture_avif", "MSFT_texture_dds", "MSFT_lod",
    }
)  # fmt: skip
"""Extensions that shape a surface or its picture, and are read."""
_LOOKS = frozenset(
    {
        "KHR_animation_pointer", "KHR_audio_emitter", "KHR_implicit_shapes", "KHR_lights_punctual",
        "KHR_node_hoverability", "KHR_node_selectability", "KHR_physics_rigid_bodies", "KHR_xmp",
        "KHR_interactivity", "KHR_collision_shapes", "KHR_xmp_json_ld", "AGI_articulations",
        "AGI_stk_metadata", "CESIUM_primitive_outline", "EXT_feature_metadata",
        "EXT_instance_features", "EXT_lights_ies", "EXT_lights_image_based", "EXT_mesh_features",
        "EXT_mesh_manifold", "EXT_property_animation", "EXT_structural_metadata", "FB_ngon_encoding",
        "FB_geometry_metadata", "GODOT_single_root", "MSFT_packing_normalRoughnessMetallic",
        "MSFT_packing_occlusionRoughnessMetallic", "MSFT_audio_emitter", "KHR_environment_map",
        "MX_lightmap",
    }
)  # fmt: skip
_LOOKS_BEGIN = (
    "KHR_materials_",
    "EXT_materials_",
    "ADOBE_materials_",
    "OMI_",
    "VRM",
    "VRMC_",
    "MOZ_",
)
"""Extensions that change no shape and no base colour: light, sound, physics, names, other materials."""


def harmless(extension: str) -> bool:
    """Whether a surface and its picture are read right with this extension."""
    return extension in READ or extension in _LOOKS or extension.startswith(_LOOKS_BEGIN)


class GltfFile:
    """The scene description, and the numbers of its accessors."""

    def __init__(self, path: Path) -> None:
        """Read a GLB, or a glTF with what lies beside it.

        Raises:
            InputError: "gltf-version", or "gltf-extension" for a required one that is not read.
            ValueError: the file is damaged.
        """
        self.source = path
        self.json, self._blob = _taken_apart(path.read_bytes())
        self._buffers: dict[int, bytes] = {}
        self._views: dict[int, bytes] = {}
        self._read = 0
        self.unpacked: set[str] = set()
        """Names of the compressions that were undone."""
        self._check_version()
        self._check_extensions()

    def _check_version(self) -> None:
        asset = self.json.get("asset") or {}
        version = str(asset.get("minVersion") or asset.get("version") or "2.0")
        if not version.startswith("2."):
            raise InputError(
                "gltf-version",
                f"{self.source.name} is glTF {version[:8]}; glTF 2.0 is read.",
                where=str(self.source),
                fix="Export it as glTF 2.0.",
            )

    def _check_extensions(self) -> None:
        unknown = [
            str(e) for e in self.json.get("extensionsRequired") or () if not harmless(str(e))
        ]
        if unknown:
            raise InputError(
                "gltf-extension",
                f"{self.source.name} requires {', '.join(unknown[:6])}, an extension of glTF that is not "
                "read: without it, its surface would be another.",
                where=str(self.source),
                fix="Export it without that extension.",
            )

    @property
    def unknown(self) -> tuple[str, ...]:
        """Extensions that are used, not required, and not known here."""
        used = (str(extension) for extension in self.json.get("extensionsUsed") or ())
        return tuple(extension for extension in used if not harmless(extension))

    def items(self, kind: str) -> list[dict[str, Any]]:
        """All of a list of the file, such as "nodes"; empty where it has none."""
        found = self.json.get(kind) or []
        if not isinstance(found, list):
            raise DamageError(f"its {kind} are no list")
        return found

    def item(self, kind: str, index: Any) -> dict[str, Any]:
        """One of a list of the file.

        Raises:
            ValueError: there is none of this number.
        """
        found = self.items(kind)
        if not isinstance(index, int) or not 0 <= index < len(found):
            raise DamageError(f"it names one of its {kind} that is not there")
        return found[index]

    def array(self, index: Any) -> np.ndarray:
        """Values of an accessor, (count, components); floats where they are normalised integers.

        Raises:
            InputError: "gltf-external", "gltf-compressed".
            ValueError, KeyError, TypeError: the accessor is damaged.
        """
        accessor = self.item("accessors", index)
        width, dtype = _WIDTHS[accessor["type"]], np.dtype(_DTYPES[accessor["componentType"]])
        count = self.count(index)
        self._read += count * width
        if self._read > _MOST_READ:
            raise DamageError("its accessors have too many numbers together")
        if accessor.get("bufferView") is None:
            values = np.zeros((count, width), dtype)
        else:
            values = self._rows(accessor, count, width, dtype)
        if (sparse := accessor.get("sparse")) is not None:
            values = self._filled_in(values, sparse, width, dtype)
        if not accessor.get("normalized") or dtype.kind == "f":
            return values
        return np.maximum(values / np.iinfo(dtype).max, -1.0)

    def count(self, index: Any) -> int:
        """Elements of an accessor.

        Raises:
            ValueError: there are impossibly many.
        """
        count = self.item("accessors", index)["count"]
        if not isinstance(count, int) or not 0 <= count <= MAX_COUNT:
            raise DamageError(f"accessor {index} has {count} elements")
        return count

    def _filled_in(
        self, values: np.ndarray, sparse: dict[str, Any], width: int, dtype: np.dtype
    ) -> np.ndarray:
        """Values in which a sparse accessor replaces some."""
        count, at, new = sparse["count"], sparse["indices"], sparse["values"]
        if not isinstance(count, int) or not 0 <= count <= len(values):
            raise DamageError("a sparse accessor replaces more than there is")
        places = self._rows(at, count, 1, np.dtype(_DTYPES[at["componentType"]]))[:, 0]
        values = values.copy()
        values[places] = self._rows(new, count, width, dtype)
        return values

    def _rows(self, told: dict[str, Any], count: int, width: int, dtype: np.dtype) -> np.ndarray:
        """Rows of a view, as an accessor or a part of a sparse one names them."""
        view, offset = self.item("bufferViews", told["bufferView"]), told.get("byteOffset") or 0
        stride = view.get("byteStride") or width * dtype.itemsize
        data = self.view(told["bufferView"])
        if offset < 0 or stride < 0:
            raise DamageError("a view begins before its buffer")
        # numpy itself refuses to look beyond the end of the view.
        return np.ndarray((count, width), dtype, data, offset, (stride, dtype.itemsize))

    def view(self, index: Any) -> bytes:
        """The bytes of a buffer view, unpacked.

        Raises:
            InputError: "gltf-external", "gltf-compressed".
            ValueError: the view is damaged.
        """
        view = self.item("bufferViews", index)
        if index not in self._views:
            packed = next(
                (name for name in MESHOPT if name in (view.get("extensions") or {})), None
            )
            if packed is None or self._has_data(view.get("buffer")):
                self._views[index] = self._slice(view)
            else:
                told = view["extensions"][packed]
                self.unpacked.add(packed)
                self._views[index] = unpacked_view(self._slice(told), told, packed, self.source)
        return self._views[index]

    def _has_data(self, index: Any) -> bool:
        """Whether a buffer is more than a placeholder for what is unpacked."""
        buffer = self.item("buffers", index)
        extensions = buffer.get("extensions") or {}
        if any((extensions.get(name) or {}).get("fallback") for name in MESHOPT):
            return bool(buffer.get("uri"))
        return bool(buffer.get("uri")) or (index == 0 and self._blob is not None)

    def _slice(self, view: dict[str, Any]) -> bytes:
        data = self._buffer(view["buffer"])
        first, length = view.get("byteOffset") or 0, view["byteLength"]
        if not 0 <= first <= first + length <= len(data):
            raise DamageError("a view reaches beyond its buffer")
        return data[first : first + length]

    def _buffer(self, index: Any) -> bytes:
        buffer = self.item("buffers", index)
        if index not in self._buffers:
            uri = buffer.get("uri")
            if uri is None and (index != 0 or self._blob is None):
                raise DamageError("a buffer has no data")
            self._buffers[index] = self.resource(str(uri)) if uri is not None else self._blob or b""
        return self._buffers[index]

    def check_resources(self) -> None:
        """Refuse a file whose data lies in others that are not beside it.

        Raises:
            InputError: "gltf-external".
        """
        for number, buffer in enumerate(self.items("buffers")):
            if buffer.get("uri"):
                self._buffer(number)

    def resource(self, uri: str) -> bytes:
        """The bytes that a URI names: in the file itself, or in one beside it.

        Raises:
            InputError: "gltf-external" where that is not there, or elsewhere.
        """
        if uri.startswith("data:"):
            head, _, data = uri.partition(",")
            return base64.b64decode(data) if head.endswith(";base64") else unquote_to_bytes(data)
        folder = self.source.parent.resolve()
        name = unquote(uri).replace("\\", "/")
        file = (folder / name).resolve()
        if not file.is_relative_to(folder) or not file.is_file():
            raise InputError(
                "gltf-external",
                f"{self.source.name} keeps its data in another file: {name[:60]}, which is not beside it.",
                where=str(self.source),
                fix="Put that file where this one names it, or export as GLB: one file.",
            )
        if file.stat().st_size > _MOST_BESIDE:
            raise DamageError(f"{name[:60]} beside it has {file.stat().st_size / 1e6:.0f} MB")
        return file.read_bytes()


def _taken_apart(data: bytes) -> tuple[dict[str, Any], bytes | None]:
    """The JSON of a file, and a GLB's binary chunk."""
    blob = None
    if data.startswith(b"glTF"):
        data, blob = _chunks(data)
    described = json.loads(data.decode("utf-8-sig"))
    if not isinstance(described, dict):
        raise DamageError("its description is no object")
    return described, blob


def _chunks(data: bytes) -> tuple[bytes, bytes | None]:
    version, length = (int.from_bytes(data[k : k + 4], "little") for k in (4, 8))
    if version == 1:
        return b'{"asset": {"version": "1.0"}}', None
    if length > len(data):
        raise DamageError(f"it ends after {len(data):,} of its {length:,} bytes")
    found: dict[bytes, bytes] = {}
    at = _GLB_HEAD
    while at + _CHUNK_HEAD <= len(data):
        size, kind = int.from_bytes(data[at : at + 4], "little"), data[at + 4 : at + 8]
        at += _CHUNK_HEAD
        found.setdefault(kind, data[at : at + size])
        at += size + -size % 4
    if _JSON_CHUNK not in found:
        raise DamageError("it has no description of a scene")
    return found[_JSON_CHUNK], found.get(_BINARY_CHUNK)
