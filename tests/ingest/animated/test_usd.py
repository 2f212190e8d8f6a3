"""Animated prims of USD stages, where usd-core is there to read them; and what is said without it."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ingest.animated.animated_take import to_animated_take
from ingest.animated.detect import read_animation

STAGE = """#usda 1.0
(
    metersPerUnit = {metres}
    upAxis = "{up}"
    timeCodesPerSecond = 24
)

def Xform "World"
{{
    double3 xformOp:translate = (0, 0, 100)
    uniform token[] xformOpOrder = ["xformOp:translate"]

    def Xform "Chair"
    {{
        double3 xformOp:translate.timeSamples = {{ 1: (0, 0, 0), 49: (120, 0, 0) }}
        float xformOp:rotateZ.timeSamples = {{ 1: 0, 49: 360 }}
        float3 xformOp:scale = (40, 20, 60)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ", "xformOp:scale"]

        def Mesh "Box"
        {{
            int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
            int[] faceVertexIndices = [
                0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5]
            point3f[] points = [(-0.5, -0.5, -0.5), (0.5, -0.5, -0.5), (-0.5, 0.5, -0.5),
                (0.5, 0.5, -0.5), (-0.5, -0.5, 0.5), (0.5, -0.5, 0.5), (-0.5, 0.5, 0.5),
                (0.5, 0.5, 0.5)]
        }}
    }}
{more}
}}
"""


def write(path: Path, *, metres: float = 0.01, up: str = "Z", more: str = "") -> Path:
    path.write_text(STAGE.format(metres=metres, up=up, more=more))
    return path


def test_without_usd_core_it_says_how_to_get_it(tmp_path, refused, monkeypatch):
    for module in ("pxr", "pxr.Usd", "pxr.UsdGeom"):
        monkeypatch.setitem(sys.modules, module, None)
    told = refused("usd-missing", read_animation, write(tmp_path / "a.usda"))
    assert "pip install usd-core" in told


class TestWithUsd:
    @pytest.fixture(autouse=True)
    def _usd(self) -> None:
        pytest.importorskip("pxr")

    def test_units_axes_and_clock_are_the_stages(self, tmp_path):
        read = read_animation(write(tmp_path / "a.usda"))
        T = read.T_file_object
        assert (read.up, len(T), read.mesh.name) == ("z", 61, "Chair")
        np.testing.assert_allclose(T[:, 0, 3], np.linspace(0, 1.2, 61), atol=1e-6)
        np.testing.assert_allclose(T[:, 2, 3], 1.0, atol=1e-9)
        turned = Rotation.from_rotvec(
            np.outer(np.radians(np.linspace(0, 360, 61)), [0, 0, 1])
        ).as_matrix()
        np.testing.assert_allclose(T[:, :3, :3], turned, atol=2e-3)
        np.testing.assert_allclose(np.ptp(read.mesh.vertices, axis=0), [0.4, 0.2, 0.6], atol=1e-6)
        assert len(read.mesh.faces) == 12

    def test_y_up_stages_come_out_z_up(self, tmp_path):
        take = to_animated_take(read_animation(write(tmp_path / "a.usda", up="Y")), None)
        np.testing.assert_allclose(np.ptp(take.motion.mesh.vertices, axis=0), [0.4, 0.6, 0.2])
        np.testing.assert_allclose(take.motion.T_world_object[:, 2, 3].min(), 0.224, atol=1e-3)

    def test_a_prim_is_chosen_by_name_or_path(self, tmp_path, refused):
        other = STAGE[STAGE.index('    def Xform "Chair"') : STAGE.index("{more}")]
        path = write(tmp_path / "a.usda", more=other.format().replace("Chair", "Table"))
        assert "Chair, Table" in refused("node-ambiguous", read_animation, path)
        assert read_animation(path, "Table").mesh.name == "Table"
        assert read_animation(path, "/World/Chair").mesh.name == "Chair"
        refused("node-missing", read_animation, path, "Sofa")

    def test_damaged_files_and_other_files_are_refused(self, tmp_path, refused):
        (tmp_path / "a.usda").write_text("#usda 1.0\n(\n")
        refused("usd-unreadable", read_animation, tmp_path / "a.usda")
        write(tmp_path / "b.usda")
        (tmp_path / "c.usda").write_text("#usda 1.0\n(\n subLayers = [@./b.usda@]\n)\n")
        refused("usd-external", read_animation, tmp_path / "c.usda")
        empty = "#usda 1.0\n( timeCodesPerSecond = 24 )\n"
        (tmp_path / "d.usda").write_text(empty)
        refused("animation-missing", read_animation, tmp_path / "d.usda")

    @pytest.mark.parametrize("arc", ["references", "payload"])
    def test_a_part_in_a_file_that_is_not_there_is_not_left_out(self, tmp_path, refused, arc):
        leg = f'def "Leg" ( {arc} = @./leg of it.usda@ ) {{ }}'
        path = write(tmp_path / "a.usda", more=leg)
        told = refused("usd-external", read_animation, path)
        assert "another file that is not there: leg of it.usda" in told

    def test_what_is_not_rigid_on_the_object_is_said(self, tmp_path):
        path = write(tmp_path / "a.usda")
        assert read_animation(path, "Chair").notes == ()
        moving = """
            double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 49: (1, 0, 0) }
            uniform token[] xformOpOrder = ["xformOp:translate"]"""
        box = STAGE[STAGE.index('        def Mesh "Box"') : STAGE.index("    }}\n{more}")]
        drawer = box.replace("{{", "{" + moving).replace("}}", "}").replace("Box", "Drawer")
        points = box[box.index("points = [") + len("points = ") : box.index("]\n        }}") + 1]
        cushion = box.replace("{{", "{").replace("}}", "}").replace("Box", "Cushion")
        samples = f".timeSamples = {{ 1: {points}, 49: {points} }}"
        cushion = cushion.replace(f"points = {points}", "points" + samples)
        text = path.read_text()
        at = text.index('        def Mesh "Box"')
        path.write_text(text[:at] + drawer + cushion + text[at:])
        shape, left_out = read_animation(path, "Chair").notes
        assert "The shape of Cushion changes" in shape
        assert left_out.endswith("was left out: Drawer.")
