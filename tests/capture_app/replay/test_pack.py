"""A scene pack, read by another reader, shows what the result and the session hold."""

import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial.transform import Rotation

from capture_app.inspection import inspect_take
from capture_app.replay.scene_pack import (
    MOST_FACES,
    pack_film,
    pack_object,
    pack_result,
    pack_session,
)
from capture_app.result import body_of
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from omomo_core.body.kinematics import full_kinematics, skin
from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh
from tests.capture_app.replay.made import FRAMES, human_of, input_of, make_result, read_pack


def _bones(header, arrays, sample):
    """Positions and rotations of the joints, from the root down."""
    q = arrays["rotations"][sample].astype(float)
    R = Rotation.from_quat(q.reshape(-1, 4)).as_matrix().reshape(FRAMES, 52, 3, 3)
    rest, parents = arrays["rest_joints"].astype(float), header["joint_parents"]
    places = np.zeros((FRAMES, 52, 3))
    places[:, 0] = arrays["root"][sample]
    for j in range(1, 52):
        places[:, j] = places[:, parents[j]] + R[:, parents[j]] @ (rest[j] - rest[parents[j]])
    return places, R


@pytest.mark.parametrize("sample", [0, 1])
def test_joints_of_every_sample_are_those_of_the_motion(tmp_path: Path, sample: int) -> None:
    result = make_result(tmp_path)
    header, arrays = read_pack(pack_result(result))
    places, _ = _bones(header, arrays, sample)
    names = header["joint_names"]
    palms = [names.index("left_middle1"), names.index("right_middle1")]
    found = places[:, [*range(22), *palms]]
    assert header["samples"] == 2
    assert header["chosen"] == 0
    np.testing.assert_allclose(found, human_of(result, sample).joints, atol=3e-4)


def test_skin_with_four_bones_is_that_of_the_body(tmp_path: Path) -> None:
    result = make_result(tmp_path)
    header, arrays = read_pack(pack_result(result))
    places, R = _bones(header, arrays, 0)
    rest, vertices = arrays["rest_joints"].astype(float), arrays["body_vertices"].astype(float)
    weights = arrays["skin_weights"] / arrays["skin_weights"].sum(axis=1, keepdims=True)
    bones = arrays["skin_joints"]
    moved = np.einsum("vkij,vkj->vki", R[20][bones], vertices[:, None] - rest[bones])
    mine = (weights[..., None] * (moved + places[20][bones])).sum(axis=1)
    body, human = body_of(result), human_of(result)
    parts = (torch.tensor(x[20]).float() for x in (human.root, human.rotations, human.fingers))
    theirs = skin(body, *full_kinematics(body, *parts)).numpy()
    off = np.linalg.norm(mine - theirs, axis=1)
    assert off.mean() < 5e-4
    assert off.max() < 0.02


def test_object_moves_as_in_the_result(tmp_path: Path) -> None:
    result = make_result(tmp_path)
    _, arrays = read_pack(pack_result(result))
    T = result.object_motion.T_world_object
    np.testing.assert_allclose(arrays["object_position"], T[:, :3, 3], atol=1e-6)
    R = Rotation.from_quat(arrays["object_rotation"]).as_matrix()
    np.testing.assert_allclose(R, T[:, :3, :3], atol=1e-6)
    np.testing.assert_allclose(arrays["palm_miss"][1], result.people[1].miss, atol=1e-7)


def test_contacts_lie_on_the_object_beside_their_anchors(tmp_path: Path) -> None:
    result = make_result(tmp_path)
    header, _ = read_pack(pack_result(result))
    half = result.object_motion.mesh.vertices.max(axis=0)
    for told, held in zip(header["contacts"][1], result.people[1].segments, strict=True):
        assert (told["start"], told["stop"]) == (held.start, held.stop)
        np.testing.assert_allclose(told["anchor"], held.anchor, atol=1e-5)
        assert np.abs(told["place"] / half).max() == pytest.approx(1.0, abs=1e-3)
        assert np.linalg.norm(told["normal"]) == pytest.approx(1.0, abs=1e-3)
        assert np.linalg.norm(np.subtract(told["place"], told["anchor"])) < 0.2


def _inputs(folder: Path):
    shutil.copytree(DEMO / SESSION, folder / "take")
    shutil.copy(DEMO / MOUNT, folder / "mount.json")
    return input_of("session", folder / "take"), input_of("mount", folder / "mount.json")


def test_recording_of_a_result_is_shown_while_it_is_there(tmp_path: Path) -> None:
    result = make_result(tmp_path, _inputs(tmp_path))
    header, arrays = read_pack(pack_result(result))
    assert header["report"]["app"] == "Stray Scanner"
    assert len(arrays["phone_position"]) == len(arrays["tracking"]) == FRAMES
    assert (arrays["tracking"] == 0).all()
    assert arrays["phone_speed"].max() < 2.0
    times, offsets = arrays["film_times"], arrays["film_offsets"]
    assert times[0] == pytest.approx(0.0, abs=0.1)
    assert times[-1] == pytest.approx((FRAMES - 1) / 30, abs=0.2)
    first = arrays["film_jpeg"][offsets[0] : offsets[1]]
    picture = cv2.imdecode(first, cv2.IMREAD_COLOR)
    assert picture is not None
    assert picture.shape[:2] == (header["film"]["height"], header["film"]["width"])
    assert max(picture.shape[:2]) <= 320


def test_film_of_a_result_is_packed_apart_from_the_rest(tmp_path: Path) -> None:
    result = make_result(tmp_path, _inputs(tmp_path))
    whole, with_film = read_pack(pack_result(result))
    rest, without = read_pack(pack_result(result, film=False))
    alone, film = read_pack(pack_film(result))
    assert {**rest, "film": whole["film"], "arrays": whole["arrays"]} == whole
    assert without.keys() | film.keys() == with_film.keys()
    assert not without.keys() & film.keys()
    assert alone["film"] == whole["film"]
    for name, array in film.items():
        np.testing.assert_array_equal(array, with_film[name])


def test_result_whose_recording_is_gone_is_shown_without_it(tmp_path: Path) -> None:
    result = make_result(tmp_path, _inputs(tmp_path))
    shutil.rmtree(tmp_path / "take")
    header, arrays = read_pack(pack_result(result))
    assert "phone_position" not in arrays
    assert header["film"] is None
    assert any("recording is not shown" in note for note in header["notes"])
    header, arrays = read_pack(pack_film(result))
    assert header["film"] is None
    assert not arrays


def test_a_result_is_called_and_told_as_who_shows_it_says(tmp_path: Path) -> None:
    result = make_result(tmp_path)
    header, _ = read_pack(pack_result(result, name="The chair", words=lambda told: [len(told)]))
    assert header["name"] == "The chair"
    assert header["notes"] == [len(read_pack(pack_result(result))[0]["notes"])]


def test_film_can_be_left_out(tmp_path: Path) -> None:
    header, arrays = read_pack(pack_session(inspect_take(DEMO / SESSION), film=False))
    assert header["film"] is None
    assert "film_jpeg" not in arrays
    assert "phone_position" in arrays


def _jumped(folder: Path) -> Path:
    """The demo's session with the tracker 40 cm off from its middle on."""
    take = folder / "take"
    shutil.copytree(DEMO / SESSION, take)
    lines = (take / "odometry.csv").read_text().splitlines()
    column = [name.strip() for name in lines[0].split(",")].index("x")
    for k in range(len(lines) // 2, len(lines)):
        cells = lines[k].split(",")
        cells[column] = f" {float(cells[column]) + 0.4:.6f}"
        lines[k] = ",".join(cells)
    (take / "odometry.csv").write_text("\n".join(lines) + "\n")
    return take


def test_session_shows_where_the_tracker_jumped(tmp_path: Path) -> None:
    seen = inspect_take(_jumped(tmp_path))
    header, arrays = read_pack(pack_session(seen, film=False))
    broken = np.flatnonzero(arrays["tracking"] == 2)
    jumps = [event for event in header["events"] if event["name"] == "tracking jump"]
    assert len(jumps) == 1
    assert jumps[0]["start"] - 2 <= broken[0] <= broken[-1] <= jumps[0]["stop"] + 2
    assert jumps[0]["fix"]
    assert len(header["stretches"]) == 2
    assert np.isnan(arrays["phone_speed"][broken]).all()
    step = np.linalg.norm(np.diff(arrays["phone_position"], axis=0), axis=1)
    assert broken[0] - 1 <= step.argmax() <= broken[-1] + 1


def test_session_with_mesh_and_mount_shows_the_object() -> None:
    seen = inspect_take(DEMO / SESSION, DEMO / MESH, DEMO / MOUNT)
    header, arrays = read_pack(pack_session(seen, film=False))
    assert header["object"]["name"] == Path(MESH).stem
    T = seen.take.motion.T_world_object
    np.testing.assert_allclose(arrays["object_position"], T[:, :3, 3], atol=1e-6)
    apart = np.linalg.norm(arrays["object_position"] - arrays["phone_position"], axis=1)
    assert np.ptp(apart) < 1e-4


def test_session_in_which_nothing_is_usable_is_shown_as_it_is(tmp_path: Path) -> None:
    take = tmp_path / "take"
    shutil.copytree(DEMO / SESSION, take)
    lines = (take / "odometry.csv").read_text().splitlines()
    (take / "odometry.csv").write_text("\n".join(lines[:1] + lines[1::60]) + "\n")
    seen = inspect_take(take)
    assert seen.take is None
    header, arrays = read_pack(pack_session(seen, film=False))
    assert header["report"]["verdict"] == "not usable"
    assert header["notes"]
    assert arrays["phone_position"][0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-6)


def test_times_without_sense_are_refused(tmp_path: Path) -> None:
    take = tmp_path / "take"
    shutil.copytree(DEMO / SESSION, take)
    lines = (take / "odometry.csv").read_text().splitlines()
    cells = [line.split(",") for line in lines]
    for row in cells[1:]:
        row[0] = f"{1e5 * float(row[0]):.6f}"
    (take / "odometry.csv").write_text("\n".join(",".join(row) for row in cells) + "\n")
    with pytest.raises(InputError) as problem:
        pack_session(inspect_take(take), film=False)
    assert problem.value.fix


def test_heavy_object_is_made_light_for_the_eye() -> None:
    ball = trimesh.creation.icosphere(subdivisions=6, radius=0.3)
    mesh = ObjectMesh(np.asarray(ball.vertices), np.asarray(ball.faces), "ball")
    assert len(mesh.faces) > MOST_FACES
    header, arrays = read_pack(pack_object(mesh))
    assert header["object"] == {"name": "ball", "faces": len(mesh.faces), "decimated": True}
    assert len(arrays["object_faces"]) <= MOST_FACES
    radius = np.linalg.norm(arrays["object_vertices"], axis=1)
    np.testing.assert_allclose(radius, 0.3, atol=2e-3)
    assert arrays["object_position"][0, 2] == pytest.approx(0.3, abs=1e-3)


def test_faults_and_grips_are_those_of_each_sample(tmp_path: Path) -> None:
    result = make_result(tmp_path)
    miss = np.zeros((FRAMES, 2))
    miss[6:12, 1] = 0.08
    people = (replace(result.people[0], miss=miss), *result.people[1:])
    rough = replace(result, people=people, unsolved=frozenset({1}))
    faults = read_pack(pack_result(rough))[0]["faults"]
    assert faults[1] == []
    palm = next(told for told in faults[0] if "right palm" in told["message"])
    assert (palm["start"], palm["stop"], palm["severity"]) == (6, 11, "warn")
    assert "From 0.20 to 0.40 s the right palm is up to 8 cm off" in palm["message"]
    assert len(read_pack(pack_result(rough))[0]["grips"]) == len(people)
