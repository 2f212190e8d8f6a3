"""The paper's measures, computed again in another way, and what they must not depend on."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import full_kinematics
from omomo_core.learning.evaluation.metrics import (
    average,
    clusters,
    floor_height,
    foot_measures,
    joint_errors,
    root_orientation_errors,
    spread,
    vertex_error,
)
from omomo_core.learning.evaluation.real_clips import RealClip
from omomo_core.learning.evaluation.truth import Touching, Truth
from omomo_core.motion import HumanMotion
from tests.core.movers import mover, resembling

seeds = st.integers(0, 10_000)


def test_every_figure_of_the_truth_itself():
    truth = Truth(mover("sub1_box_001", 12))
    person = resembling(truth.clip, 0.0, 0)
    row = truth.of_joints(person) | truth.of_skin(person, truth.clip.body)
    zero = {"hand_jpe_cm", "left_hand_jpe_cm", "mpjpe_cm", "mpvpe_cm", "t_root_cm", "o_root_deg"}
    assert {key: row[key] for key in zero} == pytest.approx(dict.fromkeys(zero, 0), abs=1e-4)
    held = truth.held[0].any()
    for score in ("precision", "recall", "f1"):
        assert row[f"contact_{score}"] == float(held)


@given(seeds)
def test_joint_errors_by_loops(seed: int):
    rng = np.random.default_rng(seed)
    joints, true = rng.normal(size=(2, 5, 24, 3))
    by_loops = {"hand": 0.0, "pose": 0.0, "root": 0.0}
    for t in range(5):
        for j in (22, 23):
            by_loops["hand"] += np.sqrt(sum((joints[t, j] - true[t, j]) ** 2)) / 10
        for j in range(24):
            gap = (joints[t, j] - joints[t, 0]) - (true[t, j] - true[t, 0])
            by_loops["pose"] += np.sqrt(gap @ gap) / (5 * 24)
        by_loops["root"] += np.sqrt(sum((joints[t, 0] - true[t, 0]) ** 2)) / 5
    found = joint_errors(joints, true)
    assert found["hand_jpe_cm"] == pytest.approx(100 * by_loops["hand"])
    assert found["mpjpe_cm"] == pytest.approx(100 * by_loops["pose"])
    assert found["t_root_cm"] == pytest.approx(100 * by_loops["root"])


def test_one_vertex_of_a_thousand_is_a_thousandth_of_its_error():
    joints, vertices = np.zeros((2, 24, 3)), np.zeros((2, 1000, 3))
    moved = vertices + 3.0
    moved[:, 7, 1] += 0.5
    assert vertex_error(moved, joints + 3.0, vertices, joints) == pytest.approx(0.05)


def test_mpvpe_by_linear_blend_skinning_in_loops():
    truth = Truth(mover("sub1_box_001", 3))
    person, body = resembling(truth.clip, 0.1, 1), truth.clip.body
    error = truth.of_skin(person, body)["mpvpe_cm"]
    chosen = np.arange(0, len(body.vertices), 7)
    gap = []
    for human in (person, resembling(truth.clip, 0.0, 0)):
        fingers = body.relaxed_fingers.double().expand(3, 30, 3, 3)
        joints, R = full_kinematics(
            body, torch.from_numpy(human.root), torch.from_numpy(human.rotations), fingers
        )
        rest = body.rest_joints.numpy()
        moved = np.zeros((3, len(chosen), 3))
        for n, v in enumerate(chosen):
            for k, weight in zip(body.skin_joints[v], body.skin_weights[v], strict=True):
                way = body.vertices[v].numpy() - rest[k]
                moved[:, n] += float(weight) * (R[:, k].numpy() @ way + joints[:, k].numpy())
        gap.append(moved - human.joints[:, :1])
    # Every seventh vertex stands for all.
    by_loops = 100 * np.linalg.norm(gap[0] - gap[1], axis=-1).mean()
    assert error == pytest.approx(by_loops, rel=0.02)


@given(seeds)
def test_orientation_error_by_inverse_and_by_angle(seed: int):
    R, true = Rotation.random(6, rng=seed), Rotation.random(6, rng=seed + 1)
    found = root_orientation_errors(R.as_matrix(), true.as_matrix())
    norms = [
        np.linalg.norm(np.identity(3) - a @ np.linalg.inv(b), "fro")
        for a, b in zip(R.as_matrix(), true.as_matrix(), strict=True)
    ]
    assert found["o_root"] == pytest.approx(np.mean(norms))
    angle = np.degrees((R * true.inv()).magnitude()).mean()
    assert found["o_root_deg"] == pytest.approx(angle, abs=1e-4)


def dbscan(values: np.ndarray, near: float, enough: int) -> set[tuple[float, ...]]:
    """By its definition: cores that reach each other, then their neighbours, then the rest."""
    close = np.abs(values[:, None] - values) <= near
    core, label = close.sum(axis=1) >= enough, np.full(len(values), -1)
    for k in range(len(values)):
        if not core[k] or label[k] >= 0:
            continue
        reached = [k]
        for i in reached:
            if label[i] < 0:
                label[i] = k
                reached += list(np.flatnonzero(close[i])) if core[i] else []
    return {tuple(values[label == k]) for k in set(label)}


@given(st.lists(st.integers(0, 300), max_size=60))
def test_clusters_are_those_of_dbscan(millimetres: list[int]):
    # Off the grid of the neighbourhood's size: no two values are just as far apart as it is wide.
    values = np.sort(np.array(millimetres) * 0.0007)
    found = {tuple(cluster) for cluster in clusters(values)}
    assert found == (dbscan(values, 0.005, 3) if len(values) else set())


@given(seeds)
def test_foot_sliding_by_loops(seed: int):
    rng = np.random.default_rng(seed)
    joints = np.cumsum(rng.normal(0, 0.004, (40, 24, 3)), axis=0)
    joints[..., 2] += 0.02
    heights: list[float] = []
    for toe in (10, 11):
        for t in range(40):
            u = min(t, 38)
            if np.linalg.norm(joints[u + 1, toe] - joints[u, toe]) < 0.005:
                heights.append(joints[t, toe, 2])
    groups = dbscan(np.sort(heights), 0.005, 3) if heights else set()
    floor = min((float(np.median(group)) for group in groups), default=0.0)
    assert floor_height(joints) == pytest.approx(floor)
    slid = 0.0
    for foot, limit in ((7, 0.08), (8, 0.08), (10, 0.04), (11, 0.04)):
        for t in range(39):
            z = joints[t, foot, 2] - floor
            way = np.linalg.norm(joints[t + 1, foot, :2] - joints[t, foot, :2])
            # Below the floor the published weight goes on growing to 2.
            if z < limit:
                slid += way * (2 - 2 ** (z / limit)) / 40 / 4
    assert foot_measures(joints)["foot_sliding_cm"] == pytest.approx(100 * slid)


def test_touch_by_brute_force():
    clip = mover("sub1_box_001", 20)
    touching, mesh = Touching(clip.motion), clip.motion.mesh
    rng = np.random.default_rng(0)
    local = rng.uniform(-0.35, 0.35, (20, 2, 3))
    T = clip.motion.T_world_object
    palms = np.einsum("tij,tpj->tpi", T[:, :3, :3], local) + T[:, None, :3, 3]
    nearest = np.stack([cdist(p, mesh.vertices).min(axis=1) for p in local])
    np.testing.assert_array_equal(touching.at_vertices(palms), nearest < 0.05)
    beyond = np.abs(local) - [0.15, 0.2, 0.25]
    outside = np.linalg.norm(beyond.clip(min=0), axis=-1)
    surface = np.where(outside > 0, outside, -beyond.max(axis=-1))
    clear = np.abs(surface - 0.05) > 0.004
    np.testing.assert_array_equal(touching.palms(palms)[clear], (surface < 0.05)[clear])
    assert (touching.palms(palms) >= touching.at_vertices(palms)).all()


@pytest.mark.parametrize("size", [0.3, 1.5])
def test_collisions_of_a_box_by_its_formula(size: float):
    clip = mover("sub1_box_001", 30)
    mesh = clip.motion.mesh
    sides = np.array([0.6, 0.8, 1.0]) * size
    scaled = replace(mesh, vertices=mesh.vertices / [0.3, 0.4, 0.5] * sides)
    motion = replace(clip.motion, mesh=scaled)
    rng, T = np.random.default_rng(1), motion.T_world_object
    depths, places = [], []
    while len(places) < 30:
        points = rng.uniform(-0.55, 0.55, (2, 3)) * sides
        depth = max(0.0, float((sides / 2 - np.abs(points)).min(axis=1).max()))
        # Distances are read off a grid.
        if min(abs(depth - 0.04), abs(depth - 0.02 * size)) > 0.005:
            depths.append(depth)
            places.append(points)
    local = np.stack(places)
    world = np.einsum("tij,tpj->tpi", T[:, :3, :3], local) + T[:, None, :3, 3]
    found = Touching(motion).collisions(world)
    assert found["collision_share"] == pytest.approx(np.mean(np.array(depths) > 0.04))
    # 4 % of half the largest side, which is `size`.
    published = np.mean(np.array(depths) > 0.04 * size / 2)
    assert found["collision_share_published"] == pytest.approx(published)
    assert 0 < published < 1


def moved(clip: RealClip, yaw: float, way: np.ndarray) -> RealClip:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rotation.from_euler("z", yaw).as_matrix(), way
    return replace(
        clip,
        motion=replace(clip.motion, T_world_object=T @ clip.motion.T_world_object),
        root=clip.root @ T[:3, :3].T + way,
        rotations=T[:3, :3] @ clip.rotations,
        joints=clip.joints @ T[:3, :3].T + way,
    )


def moved_person(person: HumanMotion, yaw: float, way: np.ndarray) -> HumanMotion:
    R = Rotation.from_euler("z", yaw).as_matrix()
    return replace(
        person,
        root=person.root @ R.T + way,
        rotations=R @ person.rotations,
        joints=person.joints @ R.T + way,
    )


@settings(max_examples=3)
@given(st.floats(-np.pi, np.pi), st.tuples(*[st.floats(-3, 3)] * 2), seeds)
def test_no_figure_depends_on_where_the_scene_is(yaw: float, place, seed: int):
    clip, way = mover("sub1_box_001", 6, seed), np.array([*place, 0.0])
    person = resembling(clip, 0.05, seed)
    rows = []
    for c, p in ((clip, person), (moved(clip, yaw, way), moved_person(person, yaw, way))):
        truth = Truth(c)
        rows.append(truth.of_joints(p) | truth.of_skin(p, c.body))
    assert rows[1] == pytest.approx(rows[0], abs=2e-3)


@settings(max_examples=4)
@given(st.lists(st.floats(0, 0.3), min_size=2, max_size=4), seeds)
def test_the_best_of_more_samples_is_never_worse_and_shares_are_shares(aways, seed: int):
    truth = Truth(mover("sub1_box_001", 4, seed))
    people = [resembling(truth.clip, away, seed + k) for k, away in enumerate(aways)]
    body, best = truth.clip.body, np.inf
    for count in range(1, len(people) + 1):
        answer = truth.answer(people[:count], 0, body)
        assert answer.best["mpjpe_cm"] <= best
        assert answer.best["hand_jpe_best_cm"] <= answer.best["hand_jpe_cm"]
        assert answer.best["mpjpe_cm"] <= answer.mean["mpjpe_cm"] + 1e-9
        best = answer.best["mpjpe_cm"]
        for key, value in answer.best.items():
            assert value >= 0, key
            if key.endswith(("precision", "recall", "f1", "share", "share_published")):
                assert value <= 1, key


def test_windows_in_which_nobody_touches_count_as_failures_or_not_at_all():
    hit = {"hit": 2.0, "found": 4.0, "true": 2.0}
    none = dict.fromkeys(hit, 0.0)
    rows = []
    for frames, score in ((hit, 0.5), (none, 0.0)):
        row: dict[str, float] = {}
        for side in ("", "left_", "right_"):
            touches = frames if side != "right_" else none
            row |= {f"{side}contact_{k}_frames": v for k, v in touches.items()}
            value = score if side != "right_" else 0.0
            row |= {f"{side}contact_{k}": value for k in ("precision", "recall", "f1")}
        rows.append(row)
    mean = average(rows)
    assert mean["contact_f1"] == 0.25
    assert mean["contact_f1_where_held"] == 0.5
    assert mean["hand_contact_f1"] == 0.5
    assert mean["contact_precision_all_frames"] == 0.5
    assert average(rows[1:])["contact_f1_where_held"] == 0.0


def test_medians_and_shares_of_clips():
    rows = [
        {"t_root_cm": 10.0, "mpjpe_cm": 1.0, "left_onset_error_s": 0.1, "right_onset_error_s": 0.5},
        {"t_root_cm": 70.0, "mpjpe_cm": 2.0, "left_onset_error_s": 0.2},
        {"t_root_cm": 30.0, "mpjpe_cm": 9.0},
    ]
    assert spread(rows) == {
        "mpjpe_cm_median": 2.0,
        "t_root_cm_median": 30.0,
        "t_root_over_60_cm_share": pytest.approx(1 / 3),
        "onset_error_s_median": 0.2,
    }
    assert average(rows)["left_onset_error_s"] == pytest.approx(0.15)


def test_touching_while_it_moves_is_scored_over_all_frames():
    scores = {"hit": 30.0, "found": 40.0, "true": 60.0}
    rows = [{f"must_hold_contact_{k}_frames": n * v for k, v in scores.items()} for n in (1.0, 3.0)]
    assert average(rows)["must_hold_contact_f1_all_frames"] == pytest.approx(0.6)
