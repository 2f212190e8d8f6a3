"""The script that Blender runs, with a stand-in for Blender; tools/check_in_blender.sh runs the real one."""

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from capture_app.exports.in_blender import convert


class FakeImage:
    def __init__(self, packed: object) -> None:
        self.packed_file, self.filepath_raw, self.file_format = packed, "//textures/packed/a", ""

    def save(self) -> None:
        Path(self.filepath_raw).write_bytes(b"a picture")


def test_the_pictures_of_a_glb_are_embedded_in_the_fbx(monkeypatch: pytest.MonkeyPatch) -> None:
    images = [FakeImage(object()), FakeImage(None)]
    seen: dict[str, Any] = {}

    def export(**options: Any) -> None:
        seen.update(options, read=[Path(images[0].filepath_raw).read_bytes()])

    bpy = ModuleType("bpy")
    scene = SimpleNamespace(render=SimpleNamespace(), unit_settings=SimpleNamespace())
    bpy.context = SimpleNamespace(scene=scene)  # type: ignore[attr-defined]
    bpy.data = SimpleNamespace(  # type: ignore[attr-defined]
        objects=[], actions=[SimpleNamespace(frame_range=(0.0, 9.0))], images=images
    )
    bpy.ops = SimpleNamespace(  # type: ignore[attr-defined]
        wm=SimpleNamespace(read_factory_settings=lambda **_: None),
        import_scene=SimpleNamespace(gltf=lambda **_: None),
        export_scene=SimpleNamespace(fbx=export),
    )
    monkeypatch.setitem(sys.modules, "bpy", bpy)
    convert("a.glb", "a.fbx", 30.0, "y", "cm")
    assert (seen["path_mode"], seen["embed_textures"], seen["read"]) == (
        "COPY",
        True,
        [b"a picture"],
    )
    assert images[1].filepath_raw == "//textures/packed/a"
