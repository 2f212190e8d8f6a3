"""A GLB or VRM that carries the motion itself: it stays the character that it was, and moves."""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from benchmarks.characters import WrittenGlb
from capture_app.exports.exported_take import Y_UP
from capture_app.exports.glb_character import write_character
from capture_app.exports.refit import take_on_target
from capture_app.exports.resample import Sampled
from capture_app.exports.target_skeleton import read_target
from tests.rigs import KINDS, Rig, RigKind, make_rig, write_rig


def _scene(path: Path) -> dict:
    whole = path.read_bytes()
    return json.loads(whole[20 : 20 + struct.unpack_from("<I", whole, 12)[0]])


def _changed(path: Path, change) -> Path:
    """The same file with another JSON."""
    whole = path.read_bytes()
    length = struct.unpack_from("<I", whole, 12)[0]
    scene = json.loads(whole[20 : 20 + length])
    change(scene)
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    rest = whole[20 + length :]
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
    path.write_bytes(head + struct.pack("<I4s", len(text), b"JSON") + text + rest)
    return path


@pytest.fixture
def moved(small_motion, shipped, tmp_path):
    """Write a take into a character; its scene before, and what was written, whose joints are right."""

    def move(character: Path, rig: Rig) -> tuple[dict, WrittenGlb]:
        before, output, target = _scene(character), tmp_path / "moved.glb", read_target(character)
        take, _ = take_on_target(Sampled(*small_motion(1), 30.0), shipped, target)
        write_character(output, target.character, take)
        glb = WrittenGlb(output, 30)
        for j, name in enumerate(take.skeleton.names):
            T = glb.world(glb.names[name], moved=True)
            np.testing.assert_allclose(T[:, :3, 3], take.positions[:, j] @ Y_UP.T, atol=1e-5)
            R = T[:, :3, :3] / np.linalg.norm(T[:, :3, :3], axis=1, keepdims=True)
            np.testing.assert_allclose(R, Y_UP @ take.rotations[:, j], atol=1e-4)
        assert len(take.skeleton.names) == len(rig.names)
        return before, glb

    return move


@pytest.mark.parametrize("kind", ["mixamo", "unreal"])
def test_the_file_stays_the_character_that_it_was_and_moves(moved, tmp_path, kind):
    rig = make_rig(KINDS[kind])
    before, glb = moved(write_rig(rig, tmp_path / "character.glb"), rig)
    after = glb.scene
    for part in ("skins", "meshes", "nodes", "accessors", "bufferViews"):
        kept = len(before[part])
        assert after[part][:kept] == before[part]
    assert [after["nodes"][n]["name"] for n in after["scenes"][0]["nodes"]] == [
        "Armature",
        "object",
    ]


def test_a_vrm_keeps_what_makes_it_one(moved, tmp_path):
    rig = make_rig(RigKind("vrm", 1.0, vrm=True))
    before, glb = moved(write_rig(rig, tmp_path / "character.vrm"), rig)
    assert glb.scene["extensions"]["VRMC_vrm"] == before["extensions"]["VRMC_vrm"]


def test_a_character_in_centimetres_is_scaled_to_the_metres_of_the_format(moved, tmp_path):
    rig = make_rig(KINDS["mixamo"])  # its bones are in centimetres, below a node that scales

    def unscaled(scene: dict) -> None:
        del scene["nodes"][-1]["scale"]

    _, glb = moved(_changed(write_rig(rig, tmp_path / "character.glb"), unscaled), rig)
    assert glb.scene["nodes"][glb.names["metres"]]["scale"] == [0.01] * 3


def test_nodes_with_a_matrix_move_too(moved, tmp_path):
    rig = make_rig(KINDS["rigify"])

    def as_matrices(scene: dict) -> None:
        from scipy.spatial.transform import Rotation

        for node in scene["nodes"][: len(rig.names)]:
            T = np.eye(4)
            T[:3, :3] = Rotation.from_quat(node.pop("rotation")).as_matrix()
            T[:3, 3] = node.pop("translation")
            node["matrix"] = T.T.reshape(-1).tolist()

    _, glb = moved(_changed(write_rig(rig, tmp_path / "character.glb"), as_matrices), rig)
    assert not any("matrix" in node for node in glb.scene["nodes"][: len(rig.names)])


def test_its_own_animations_and_what_no_reader_of_ours_knows_stay(moved, tmp_path):
    rig = make_rig(KINDS["mixamo"])

    def richer(scene: dict) -> None:
        scene["animations"] = [{"name": "wave", "channels": [], "samplers": []}]
        scene["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_5"] = 0
        scene["nodes"][0]["extensions"] = {"OTHER_bones": {"kind": "hair"}}

    _, glb = moved(_changed(write_rig(rig, tmp_path / "character.glb"), richer), rig)
    assert [one["name"] for one in glb.scene["animations"]] == ["take", "wave"]
    assert glb.scene["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_5"] == 0
    assert glb.scene["nodes"][0]["extensions"] == {"OTHER_bones": {"kind": "hair"}}
