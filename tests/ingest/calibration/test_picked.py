"""Pairs of points as people write them, and the mount they give."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.calibration.phone_body import body_point, phone_body, phone_named
from ingest.calibration.picked_points import mount_from_pairs
from ingest.calibration.point_pairs import PointPair, load_pairs, save_pairs, typed_pair
from ingest.uncertainty import between, bounds_95, moved
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

PHONE = phone_named("iPhone 15")
NAMES = [
    "top left back corner",
    "top right back",
    "bottom middle front",
    "left middle back",
    "lens",
]


def _object_phone(rng: np.random.Generator) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.random(rng=rng).as_matrix()
    T[:3, 3] = rng.uniform(-0.4, 0.4, 3)
    return T


def _named(
    T_object_body: np.ndarray, rng: np.random.Generator, sigma: float = 0.0
) -> list[PointPair]:
    pairs = []
    for name in NAMES:
        at = (T_object_body @ [*body_point(PHONE, name), 1])[:3] + rng.normal(size=3) * sigma
        pairs.append(PointPair(name, (float(at[0]), float(at[1]), float(at[2]))))
    return pairs


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1))
def test_names_and_numbers_give_the_mount(seed: int):
    rng = np.random.default_rng(seed)
    T_object_phone = _object_phone(rng)
    T_phone_body = phone_body(PHONE)[0]
    by_name = mount_from_pairs(_named(T_object_phone @ T_phone_body, rng), PHONE)
    np.testing.assert_allclose(by_name.mount.T_phone_object, inverse(T_object_phone), atol=1e-9)
    assert by_name.mount.phone == "iPhone 15"
    seen = rng.uniform(-0.2, 0.2, (4, 3))
    there = seen @ T_object_phone[:3, :3].T + T_object_phone[:3, 3]
    numbers = [
        PointPair(tuple(p), tuple(q)) for p, q in zip(seen.tolist(), there.tolist(), strict=True)
    ]
    by_number = mount_from_pairs(numbers)
    np.testing.assert_allclose(by_number.mount.T_phone_object, inverse(T_object_phone), atol=1e-9)
    mixed = mount_from_pairs(numbers[:2] + _named(T_object_phone @ T_phone_body, rng)[:2], PHONE)
    np.testing.assert_allclose(mixed.mount.T_phone_object, inverse(T_object_phone), atol=1e-9)


def test_the_truth_is_inside_the_bounds_though_the_phone_differs_from_its_drawing():
    rng = np.random.default_rng(2)
    T_phone_body, covariance = phone_body(PHONE)
    inside, tries = np.zeros(2), 120
    for _ in range(tries):
        real = moved(T_phone_body, rng.multivariate_normal(np.zeros(6), covariance))
        T_object_phone = _object_phone(rng)
        # Without the lens, which the real phone has elsewhere.
        pairs = _named(T_object_phone @ real, rng, 0.002)[:4]
        mount = mount_from_pairs(pairs, PHONE).mount
        assert mount.covariance is not None
        step, bounds = between(mount.T_phone_object, inverse(T_object_phone)), mount.covariance
        told = bounds_95(bounds)
        inside += [
            1e3 * np.linalg.norm(step[3:]) < told.mm,
            np.degrees(np.linalg.norm(step[:3])) < told.deg,
        ]
    assert (inside / tries > 0.92).all()


def test_many_points_do_not_average_the_phones_sizes_away():
    rng = np.random.default_rng(3)
    T = _object_phone(rng)
    pairs = [p for _ in range(30) for p in _named(T, rng, 1e-4)]
    mount = mount_from_pairs(pairs, PHONE).mount
    assert mount.covariance is not None
    assert bounds_95(mount.covariance).mm > bounds_95(phone_body(PHONE)[1]).mm


def test_notes_say_what_is_doubtful():
    rng = np.random.default_rng(4)
    pairs = [*_named(np.eye(4), rng), PointPair("right middle front", (0.5, 0.5, 0.5))]
    picked = mount_from_pairs(pairs, PHONE)
    assert "'right middle front' was left out" in picked.mount.note
    flat = mount_from_pairs([p for p in pairs if "back" in p.name][:3], PHONE)
    assert "flat" in flat.mount.note


def test_the_scale_of_the_mesh_comes_along():
    rng = np.random.default_rng(5)
    T = _object_phone(rng)
    pairs = _named(T, rng)
    small = [PointPair(p.phone, (p.object[0] / 2, p.object[1] / 2, p.object[2] / 2)) for p in pairs]
    mount = mount_from_pairs(small, PHONE, scaled=True).mount
    assert mount.object_scale == pytest.approx(2)
    with pytest.raises(InputError) as caught:
        mount_from_pairs(small, PHONE)
    assert caught.value.code == "points-scale"


def test_what_is_missing_or_in_millimetres():
    rng = np.random.default_rng(6)
    with pytest.raises(InputError) as caught:
        mount_from_pairs(_named(np.eye(4), rng))
    assert caught.value.code == "phone-needed"
    assert "top left back corner" in caught.value.what
    far = [PointPair((10.0 * k, 1.0 * k * k, 0.0), (0.1 * k, 0.0, 0.0)) for k in range(4)]
    with pytest.raises(InputError) as caught:
        mount_from_pairs(far)
    assert caught.value.code == "points-units"
    with pytest.raises(InputError) as caught:
        mount_from_pairs([])
    assert caught.value.code == "points-few"


def test_typed_pairs():
    assert typed_pair("lens = 0.10 0.22 0.05") == PointPair("lens", (0.10, 0.22, 0.05))
    assert typed_pair("0.01,-0.02,0 = .1,.2,.3") == PointPair((0.01, -0.02, 0.0), (0.1, 0.2, 0.3))
    for bad in ("lens", "lens = 1 2", "= 1 2 3", "lens = a b c", "lens = 1 2 3 4"):
        with pytest.raises(InputError) as caught:
            typed_pair(bad)
        assert caught.value.code == "pair-text"


PAIRS = [
    PointPair("lens", (0.1, 0.2, 0.3), 0.001),
    PointPair((0.0, 0.1, 0.2), (1.0, 2.0, 3.0), 0.004),
]


def test_files_of_pairs(tmp_path: Path):
    path = tmp_path / "pairs"
    save_pairs(PAIRS, path)
    assert load_pairs(path) == PAIRS
    path.write_text("\ufeffphone,x,y,z,sigma_mm\nlens,.1,.2,.3,1\n\n# a comment\n0 .1 .2,1,2,3,4\n")
    assert load_pairs(path) == PAIRS
    path.write_text("lens,.1,.2,.3\n")
    assert load_pairs(path, 0.007) == [PointPair("lens", (0.1, 0.2, 0.3), 0.007)]


@pytest.mark.parametrize(
    "text",
    [
        "lens,1,2",
        "lens,1,2,x",
        "lens,1,2,3,-1",
        "phone,x,y,z\nlens,1,2,3,4,5",
        "{",
        '{"points": []}',
        '{"pairs": [{"phone": "lens"}]}',
        '{"pairs": [{"phone": "lens", "object": [1, 2]}]}',
        '{"pairs": [{"phone": "lens", "object": [1, 2, 3], "sigma": 1}]}',
    ],
)
def test_damaged_files_of_pairs(tmp_path: Path, text: str):
    path = tmp_path / "pairs.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_pairs(path)
    assert caught.value.code == "pairs-unreadable"
    with pytest.raises(InputError) as caught:
        load_pairs(tmp_path / "none")
    assert caught.value.code == "pairs-missing"
