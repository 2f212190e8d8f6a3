"""Procedural props: solids on the floor of sensible size, palms on them with room for hands, scans."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.learning.synthesis.props import (
    WIDEST_HOLD,
    Use,
    make_prop,
    scaled,
    side_grasp,
)
from omomo_core.learning.synthesis.props.catalogue import MAKERS, WEIGHTS, placed
from omomo_core.learning.synthesis.props.prop import Prop
from omomo_core.learning.synthesis.shapes import SolidPart, beam, box, cylinder, joined, rod, shell

USES: tuple[Use, ...] = ("lift", "push", "one_hand", "tool", "tip")
SIZES = {
    "largetable": (0.6, 2.0, 0.65, 0.8),
    "smalltable": (0.3, 1.25, 0.3, 0.76),
    "woodchair": (0.35, 0.75, 0.7, 1.1),
    "whitechair": (0.35, 0.75, 0.7, 1.1),
    "officechair": (0.45, 0.9, 0.8, 1.25),
    "smallbox": (0.1, 0.45, 0.06, 0.65),
    "largebox": (0.25, 0.95, 0.2, 1.2),
    "suitcase": (0.3, 0.6, 0.4, 1.15),
    "monitor": (0.4, 0.75, 0.3, 0.7),
    "floorlamp": (0.15, 0.7, 1.0, 1.85),
    "tripod": (0.08, 1.2, 0.85, 1.75),
    "plasticbox": (0.25, 0.7, 0.1, 0.42),
}
"""Of some classes: least and largest width, least and largest height, metres."""


def signed_volume(part: SolidPart) -> float:
    a, b, c = (part.vertices[part.faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def solid(prop: Prop) -> trimesh.Trimesh:
    return trimesh.Trimesh(*joined(prop.parts), process=False)


def nearest(mesh: trimesh.Trimesh, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance of each point to the surface, and the nearest face."""
    n = len(mesh.faces)
    pairs = np.tile(mesh.triangles, (len(points), 1, 1)), np.repeat(points, n, axis=0)
    off = np.linalg.norm(trimesh.triangles.closest_point(*pairs) - pairs[1], axis=1)
    off = off.reshape(len(points), n)
    return off.min(axis=1), off.argmin(axis=1)


@pytest.mark.parametrize(
    ("parts", "volume"),
    [
        ([box((0, 0, 0), (1, 2, 3))], 6.0),
        ([cylinder((1, 2), 0.5, 1.5, (0.3, 0.3), 64)], np.pi * 0.09),
        ([shell(0.0, 1.0, (0.5, 0.5), 0.01, 64)], np.pi * (0.25 - 0.49**2 * 0.99)),
        (rod((0, 0, 1), (0, 0.8, 0.2), 0.05, 64), np.pi * 0.05**2 * 0.8 * 2**0.5),
        (beam((0, 0, 0), (0.5, 0, 0.5), (0, 1, 0), 0.1, 0.02), 0.1 * 0.02 * 0.5**0.5),
    ],
)
def test_solids_enclose_their_volume(parts: list[SolidPart], volume: float) -> None:
    assert sum(signed_volume(p) for p in parts) == pytest.approx(volume, rel=0.01)
    for part in parts:
        np.testing.assert_allclose(part.vertices.min(axis=0), part.low)
        np.testing.assert_allclose(part.vertices.max(axis=0), part.high)


def test_a_slanted_rod_has_small_boxes() -> None:
    pieces = rod((0, 0, 0), (0.8, 0, 0.8), 0.01)
    assert max((p.high - p.low).max() for p in pieces) < 0.16


@pytest.mark.parametrize("name", MAKERS)
def test_every_class_stands_on_the_floor_in_its_size(name: str) -> None:
    held = 0
    for seed in range(6):
        rng = np.random.default_rng(seed)
        prop = placed(rng, MAKERS[name](rng))
        assert prop.name == name
        assert prop.low[2] == pytest.approx(0.0, abs=1e-9)
        assert 0.2 <= prop.mass <= 80
        size = prop.high - prop.low
        narrow, wide, short, tall = SIZES.get(prop.name, (0.03, 1.8, 0.1, 1.9))
        assert narrow <= size[:2].max() <= wide
        assert short <= size[2] <= tall
        held += bool(prop.grasps)
    assert held >= 4


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6), use=st.sampled_from(USES))
def test_palms_lie_on_the_surface_within_reach_of_each_other(seed: int, use: Use) -> None:
    prop = make_prop(np.random.default_rng(seed), use)
    assert any(g.use == use for g in prop.grasps)
    points = np.concatenate([g.points for g in prop.grasps])
    inward = np.concatenate([g.inward for g in prop.grasps])
    np.testing.assert_allclose(np.linalg.norm(inward, axis=-1), 1.0)
    distance, face = nearest(solid(prop), points)
    assert distance.max() < 1e-3
    # A palm may lean on its place, but not lie on it with its back.
    assert ((solid(prop).face_normals[face] * inward).sum(-1)[distance < 1e-5] < 0.72).all()
    for grasp in prop.grasps:
        left, right = grasp.points
        assert np.linalg.norm(left - right) <= WIDEST_HOLD + 1e-6
        if not grasp.one_handed and grasp.kind != "pole":
            assert left[1] > right[1]
        if grasp.one_handed:
            assert np.linalg.norm(left - right) < 0.12


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6), use=st.sampled_from(USES))
def test_there_is_room_for_the_hand_outside(seed: int, use: Use) -> None:
    prop = make_prop(np.random.default_rng(seed), use)
    points = np.concatenate([g.points for g in prop.grasps])
    outward = -np.concatenate([g.inward for g in prop.grasps])
    starts = points + 0.005 * outward
    hits, rays, _ = solid(prop).ray.intersects_location(starts, outward, multiple_hits=False)
    assert (np.linalg.norm(hits - starts[rays], axis=1) > 0.034).all()
    assert (points + 0.035 * outward)[:, 2].min() > -1e-6


@settings(max_examples=12)
@given(seed=st.integers(0, 10**6), use=st.sampled_from(USES))
def test_a_scan_is_open_and_near_the_thing(seed: int, use: Use) -> None:
    prop = make_prop(np.random.default_rng(seed), use)
    mesh = prop.mesh(np.random.default_rng(seed))
    assert 150 <= len(mesh.vertices) <= 1600
    assert mesh.faces.max() == len(mesh.vertices) - 1
    scan = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert not scan.is_watertight
    off, _ = nearest(solid(prop), mesh.vertices)
    # Eight crumbs at most, of three corners each, lie about.
    assert (off > 0.006).sum() <= 24
    assert off.max() < 0.1
    off, _ = nearest(scan, np.concatenate([g.points for g in prop.grasps[::3]]))
    assert off.max() < 0.01


def test_what_overhangs_low_is_hooked_by_hanging_hands() -> None:
    hooked = [
        grasp
        for seed in range(40)
        for grasp in make_prop(np.random.default_rng(seed), "lift").grasps
        if grasp.kind == "under" and grasp.fingers is not None and grasp.points[:, 2].max() < 0.6
    ]
    assert len(hooked) > 5
    for grasp in hooked:
        assert grasp.fingers is not None
        # Fingers down along the forearm, palm to the thing and not under it.
        assert grasp.fingers[2] < -0.4
        assert np.abs(grasp.inward @ grasp.fingers).max() < 1e-6
        assert (grasp.inward[:, 0] > 0.3).all()


def test_the_same_seed_gives_the_same_prop() -> None:
    one, two = (make_prop(np.random.default_rng(5), "lift") for _ in range(2))
    np.testing.assert_array_equal(joined(one.parts)[0], joined(two.parts)[0])
    assert len(one.grasps) == len(two.grasps)


def test_all_uses_draw_from_known_classes() -> None:
    assert set(WEIGHTS) == set(USES)
    assert all(set(w) <= set(MAKERS) for w in WEIGHTS.values())


def test_scaling_moves_palms_with_the_surface() -> None:
    prop = make_prop(np.random.default_rng(3), "lift")
    large = scaled(prop, 1.2)
    np.testing.assert_allclose(large.high, 1.2 * prop.high)
    np.testing.assert_allclose(large.grasps[0].points, 1.2 * prop.grasps[0].points)


def test_sides_of_a_turned_box_are_its_turned_faces() -> None:
    prop = Prop("box", [box((-0.2, -0.15, 0), (0.2, 0.15, 0.4))], [])
    grasp = side_grasp(prop, np.pi / 2, 0.3)
    assert grasp is not None
    np.testing.assert_allclose(sorted(grasp.points[:, 0]), [-0.2, 0.2], atol=1e-5)
    np.testing.assert_allclose(grasp.points[:, 2], 0.3, atol=1e-5)
    assert side_grasp(prop, 0.0, 0.5) is None
