"""GLB files put together by hand: JSON, and arrays as accessors name them."""

import json
from pathlib import Path
from typing import Any

import numpy as np

CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Glb:
    """A file that grows: arrays become accessors, everything else is plain JSON."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "accessors": [],
            "bufferViews": [],
            "meshes": [],
            "nodes": [],
        }
        self.data = b""

    def view(self, data: bytes, **rest: Any) -> int:
        self.data += bytes(-len(self.data) % 4)
        told = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **rest}
        self.json["bufferViews"].append(told)
        self.data += data
        return len(self.json["bufferViews"]) - 1

    def array(self, values: Any, dtype: str = "f4", **rest: Any) -> int:
        rows = np.asarray(values).astype("<" + dtype)
        rows = rows.reshape(len(rows), -1)
        width = rows.shape[1]
        padded = np.zeros((len(rows), width * rows.itemsize + -width * rows.itemsize % 4), np.uint8)
        padded[:, : width * rows.itemsize] = rows.view(np.uint8).reshape(len(rows), -1)
        stride = (
            {}
            if width == 1 or padded.shape[1] == width * rows.itemsize
            else {"byteStride": padded.shape[1]}
        )
        data = rows.tobytes() if width == 1 else padded.tobytes()
        told = {"bufferView": self.view(data, **stride), "componentType": CODES[dtype]}
        self.json["accessors"].append({**told, "count": len(rows), "type": KINDS[width], **rest})
        return len(self.json["accessors"]) - 1

    def mesh(self, primitive: dict[str, Any], **rest: Any) -> int:
        self.json["meshes"].append({"primitives": [primitive], **rest})
        return len(self.json["meshes"]) - 1

    def node(self, **told: Any) -> int:
        self.json["nodes"].append(told)
        return len(self.json["nodes"]) - 1

    def write(self, path: Path) -> Path:
        self.json["buffers"] = [{"byteLength": len(self.data)}, *self.json.get("buffers", [])[1:]]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        blob = self.data + bytes(-len(self.data) % 4)
        chunks = len(text).to_bytes(4, "little") + b"JSON" + text
        chunks += len(blob).to_bytes(4, "little") + b"BIN\0" + blob
        path.write_bytes(
            b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks
        )
        return path
