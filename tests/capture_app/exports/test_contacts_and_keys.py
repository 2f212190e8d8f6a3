"""Contacts travel with every format, and keys are left out only where joints stay near."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Usd

from benchmarks.characters import WrittenGlb
from capture_app.commands.export import ExportFormat, ExportOptions
from capture_app.exports.contact_spans import contact_spans
from capture_app.exports.export_sample import contacts_file, export
from capture_app.exports.resample import Sampled
from omomo_core.body.model import BodyModel

FRAMES = 30


@pytest.fixture
def holding(small_motion: Any) -> Sampled:
    """The left palm comes to a point of the object, rests on it in frames 6 to 20, and goes."""
    human, moved = (small_motion(k)[i] for k, i in ((1, 0), (1, 1)))
    some = np.resize(np.arange(len(human.root)), FRAMES)
    T = moved.T_world_object[some]
    person = {name: getattr(human, name)[some].copy() for name in human.__dataclass_fields__}
    away = np.clip(np.maximum(6 - np.arange(FRAMES), np.arange(FRAMES) - 20), 0, None) * 0.02
    local = np.array([0.1, 0.2, 0.3]) + away[:, None] * [0, 0, 1]
    person["joints"][:, 22] = np.einsum("fxy,fy->fx", T[:, :3, :3], local) + T[:, :3, 3]
    person["hand_contact"][:] = 0.0
    person["hand_contact"][4:23, 0] = 1.0
    person["foot_contact"][:] = 0.0
    person["foot_contact"][10:, 3] = 1.0
    object_motion = replace(moved, T_world_object=T, valid=np.ones(FRAMES, bool))
    return Sampled(type(human)(**person), object_motion, 30.0)


def test_a_hand_holds_while_its_palm_rests_on_the_object(holding: Sampled) -> None:
    hand, foot = contact_spans(holding)
    assert (hand.part, hand.start, hand.stop) == ("left_hand", 6 / 30, 21 / 30)
    np.testing.assert_allclose(hand.point, [0.1, 0.2, 0.3], atol=1e-6)
    assert (foot.part, foot.start, foot.stop, foot.point) == ("right_toe", 10 / 30, 1.0, None)


def test_contacts_are_in_every_format(tmp_path: Path, holding: Sampled, shipped: BodyModel) -> None:
    def write(name: str) -> Path:
        path = tmp_path / name
        export(path, holding.human, holding.object_motion, shipped, ExportOptions())
        return path

    nodes = WrittenGlb(write("a.glb"), 30.0).scene["nodes"]
    (thing,) = (node for node in nodes if node["name"] == "object")
    contacts = thing["extras"]["contacts"]
    assert contacts[0] == {"part": "left_hand", "from": 0.2, "to": 0.7, "point": [0.1, 0.2, 0.3]}
    assert contacts[1] == {"part": "right_toe", "from": 0.333333, "to": 1.0}
    stage = Usd.Stage.Open(str(write("a.usda")))
    prim = stage.GetPrimAtPath("/take/object")
    assert list(prim.GetAttribute("contacts:part").Get()) == ["left_hand", "right_toe"]
    np.testing.assert_allclose(prim.GetAttribute("contacts:to").Get(), [0.7, 1.0])
    np.testing.assert_allclose(prim.GetAttribute("contacts:point").Get()[0], [0.1, 0.2, 0.3])
    with contacts_file(write("a.bvh")).open(newline="") as file:
        hand, foot = csv.DictReader(file)
    assert (hand["part"], hand["from_s"]) == ("left_hand", "0.2")
    assert float(hand["z"]) == pytest.approx(30.0, abs=1e-4)
    assert (foot["part"], foot["z"]) == ("right_toe", "")


@pytest.mark.parametrize("within", [1.0, 10.0])
def test_joints_stay_near_where_keys_are_left_out(
    tmp_path: Path, small_motion: Any, shipped: BodyModel, within: float
) -> None:
    human, moved = small_motion(3)
    options = ExportOptions(to=ExportFormat.glb, fps=60)
    export(tmp_path / "all.glb", human, moved, shipped, options)
    export(tmp_path / "few.glb", human, moved, shipped, options, reduce_keys=within)
    dense, few = (WrittenGlb(tmp_path / name, 60.0) for name in ("all.glb", "few.glb"))
    assert few.keys < (0.9 if within < 5 else 0.5) * dense.keys
    for node in dense.names.values():
        there, here = (glb.world(node, moved=True)[:, :3, 3] for glb in (dense, few))
        assert np.linalg.norm(there - here, axis=1).max() < 1e-3 * within + 1e-5
