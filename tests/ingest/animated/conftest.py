"""Small animated files, written by hand."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from pygltflib import (
    FLOAT,
    GLTF2,
    UNSIGNED_INT,
    Accessor,
    Animation,
    AnimationChannel,
    AnimationChannelTarget,
    AnimationSampler,
    Attributes,
    Buffer,
    BufferView,
    Mesh,
    Node,
    Primitive,
    Scene,
)

WIDTHS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


class GlbWriter:
    """A box of 0.4 x 0.6 x 0.2 m (y up) as mesh 0, and whatever nodes and channels a test wants."""

    def __init__(self) -> None:
        self.gltf = GLTF2()
        self.data = b""
        box = trimesh.creation.box((0.4, 0.6, 0.2))
        position = self.add(np.asarray(box.vertices))
        indices = self.add(np.asarray(box.faces).reshape(-1, 1))
        primitive = Primitive(attributes=Attributes(POSITION=position), indices=indices)
        self.gltf.meshes = [Mesh(primitives=[primitive])]
        self.gltf.animations = [Animation(name="take")]

    def add(self, values: np.ndarray) -> int:
        kind = "<u4" if values.dtype.kind in "iu" else "<f4"
        values = values.reshape(len(values), -1).astype(kind)
        view = BufferView(buffer=0, byteOffset=len(self.data), byteLength=values.nbytes)
        self.gltf.bufferViews.append(view)
        self.gltf.accessors.append(
            Accessor(
                bufferView=len(self.gltf.bufferViews) - 1,
                componentType=UNSIGNED_INT if kind == "<u4" else FLOAT,
                count=len(values),
                type=WIDTHS[values.shape[1]],
                min=np.nan_to_num(values.min(axis=0)).tolist(),
                max=np.nan_to_num(values.max(axis=0)).tolist(),
            )
        )
        self.data += values.tobytes()
        return len(self.gltf.accessors) - 1

    def node(self, name: str, **rest: Any) -> int:
        self.gltf.nodes.append(Node(name=name, **rest))
        return len(self.gltf.nodes) - 1

    def move(
        self, node: int, path: str, times: Any, values: Any, mode: str = "LINEAR", clip: int = 0
    ) -> None:
        animation = self.gltf.animations[clip]
        sampler = AnimationSampler(
            input=self.add(np.array(times, float)[:, None]),
            output=self.add(np.array(values, float)),
            interpolation=mode,
        )
        animation.samplers.append(sampler)
        target = AnimationChannelTarget(node=node, path=path)
        number = len(animation.samplers) - 1
        animation.channels.append(AnimationChannel(sampler=number, target=target))

    def write(self, path: Path) -> Path:
        children = {c for node in self.gltf.nodes for c in node.children or ()}
        roots = [i for i in range(len(self.gltf.nodes)) if i not in children]
        self.gltf.scenes, self.gltf.scene = [Scene(nodes=roots)], 0
        self.gltf.buffers = [Buffer(byteLength=len(self.data))]
        self.gltf.set_binary_blob(self.data)
        path.write_bytes(b"".join(self.gltf.save_to_bytes()))
        return path


@pytest.fixture
def glb() -> GlbWriter:
    return GlbWriter()


@pytest.fixture
def refused() -> Callable[..., str]:
    """Calls a function that must raise an InputError of a code; returns its text."""
    from omomo_core.errors import InputError

    def check(code: str, call: Callable[..., object], *arguments: Any, **named: Any) -> str:
        with pytest.raises(InputError) as caught:
            call(*arguments, **named)
        assert caught.value.code == code
        assert caught.value.fix
        return str(caught.value)

    return check
