"""Arrays packed into the binary chunk of a GLB, with the accessors that describe them."""

import numpy as np
from pygltflib import (
    ARRAY_BUFFER,
    ELEMENT_ARRAY_BUFFER,
    FLOAT,
    GLTF2,
    UNSIGNED_INT,
    UNSIGNED_SHORT,
    Accessor,
    Buffer,
    BufferView,
)

_COMPONENT = {"float32": FLOAT, "uint16": UNSIGNED_SHORT, "uint32": UNSIGNED_INT}
_TYPE = {(): "SCALAR", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}


class GlbBuffer:
    """Collects arrays; each `add` returns the index of a new accessor."""

    def __init__(self, gltf: GLTF2) -> None:
        self._gltf = gltf
        self._bytes = bytearray()

    def vertices(self, values: np.ndarray, dtype: str = "float32") -> int:
        """One value per vertex: positions, normals, joints, weights."""
        return self._add(values.astype(dtype), ARRAY_BUFFER)

    def indices(self, faces: np.ndarray) -> int:
        """Triangles as a flat list of vertex indices."""
        return self._add(faces.reshape(-1).astype("uint32"), ELEMENT_ARRAY_BUFFER)

    def values(self, values: np.ndarray) -> int:
        """Key frames or matrices (row, column; the file stores them column by column)."""
        values = values.astype("float32")
        return self._add(values.swapaxes(-1, -2) if values.ndim == 3 else values, None)

    def finish(self) -> None:
        """Put the bytes into the file."""
        self._gltf.buffers = [Buffer(byteLength=len(self._bytes))]
        self._gltf.set_binary_blob(bytes(self._bytes))

    def _add(self, values: np.ndarray, target: int | None) -> int:
        data = np.ascontiguousarray(values).tobytes()
        view = BufferView(
            buffer=0, byteOffset=len(self._bytes), byteLength=len(data), target=target
        )
        self._gltf.bufferViews.append(view)
        flat = values.reshape(len(values), -1)
        self._gltf.accessors.append(
            Accessor(
                bufferView=len(self._gltf.bufferViews) - 1,
                componentType=_COMPONENT[values.dtype.name],
                count=len(values),
                type=_TYPE[values.shape[1:]],
                min=flat.min(axis=0).tolist(),
                max=flat.max(axis=0).tolist(),
            )
        )
        self._bytes += data + b"\0" * (-len(data) % 4)
        return len(self._gltf.accessors) - 1
