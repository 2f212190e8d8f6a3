"""Sizes of phones: consistent with what Apple publishes, and a frame that agrees with ARKit's."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ingest.calibration.phone_body import MODELS, body_point, phone_body, phone_named
from ingest.uncertainty import bounds_95
from omomo_core.errors import InputError

LENSES = [name for name, model in MODELS.items() if model.lens]
PPI = {
    (750, 1334): 326, (828, 1792): 326, (1080, 2340): 476, (1125, 2436): 458, (1242, 2688): 458,
    (1284, 2778): 458,
}  # fmt: skip
"""Published; all others have 460."""


@pytest.mark.parametrize("name", list(MODELS))
def test_sizes_agree_with_each_other(name: str):
    model = MODELS[name]
    (width, height, thickness), screen = model.body, model.screen
    assert 60 < width < 80 < 125 < height < 165
    assert 5 < thickness < 9
    assert screen[0] < width - 4
    assert screen[1] < height - 4
    for side, pixels in zip(screen, model.pixels, strict=True):
        assert 25.4 * pixels / side == pytest.approx(PPI.get(model.pixels, 460), rel=0.0025)
    if model.lens:
        # The lens is in the corner that is at the left from behind, inside the body.
        assert 8 < model.lens.from_top < 36
        assert 8 < model.lens.from_side < 27
        assert 4 < model.lens.depth < 9
        assert model.lens.sigma >= 0.3


@pytest.mark.parametrize("name", LENSES)
def test_the_camera_is_the_origin_and_sees_out_of_the_back(name: str):
    phone = phone_named(name)
    T, covariance = phone_body(phone)
    lens = T @ [*body_point(phone, "lens"), 1]
    np.testing.assert_allclose(lens[:3], 0, atol=1e-12)
    # Held sideways with the port to the right, seen from the screen: right, up, to the viewer.
    port = body_point(phone, "bottom middle front") - body_point(phone, "top middle front")
    right = body_point(phone, "right middle front") - body_point(phone, "left middle front")
    out = body_point(phone, "centre front") - body_point(phone, "centre back")
    for axis, direction in enumerate((port, right, out)):
        turned = T[:3, :3] @ direction / np.linalg.norm(direction)
        np.testing.assert_allclose(turned, np.eye(3)[axis], atol=1e-12)
    bounds = bounds_95(covariance)
    assert 2 < bounds.mm < 6
    assert 0.5 < bounds.deg < 3


@settings(max_examples=20)
@given(
    words=st.permutations(["top", "left", "back"]),
    filling=st.sampled_from(["", " corner", " corner of the"]),
)
def test_points_by_their_names_in_any_order(words: list[str], filling: str):
    phone = phone_named("iPhone 15")
    found = body_point(phone, " ".join(words) + filling)
    np.testing.assert_allclose(found, [-0.07163 / 2, 0.14764 / 2, -0.0078])


@pytest.mark.parametrize(
    "name",
    ["", "top left", "corner", "top bottom back", "left right front", "knob back", "lens top"],
)
def test_no_such_point(name: str):
    with pytest.raises(InputError) as caught:
        body_point(phone_named("iPhone 13"), name)
    assert caught.value.code == "phone-point"


@pytest.mark.parametrize(
    ("written", "known"),
    [
        ("iphone15pro", "iPhone 15 Pro"),
        ("Apple iPhone 13 Mini", "iPhone 13 mini"),
        ("IPHONE SE 2nd gen", "iPhone SE (2nd generation)"),
        ("iPhone XR", "iPhone XR"),
    ],
)
def test_names_as_people_write_them(written: str, known: str):
    assert phone_named(written).name == known


def test_an_unknown_model_lists_the_known_ones_and_how_to_measure():
    with pytest.raises(InputError) as caught:
        phone_named("Galaxy S24")
    assert caught.value.code == "phone-unknown"
    assert "iPhone 14 Pro Max" in caught.value.what
    assert "‹ruler›" in caught.value.fix
    with pytest.raises(InputError) as caught:
        phone_named("iPhone 16 Pro")
    assert caught.value.code == "phone-lens"
    assert "from the top edge" in caught.value.fix


def test_a_ruler_serves_any_phone_and_is_less_certain():
    measured = phone_named("Galaxy S24", (70.6, 147.0, 20.0, 15.0))
    np.testing.assert_allclose(measured.lens[:2], [0.0203, 0.0535])
    assert measured.screen is None
    known = phone_named("iPhone 16 Pro", (71.5, 149.5, 33.0, 14.0))
    assert known.pixels == (1206, 2622)
    sure = phone_body(phone_named("iPhone 15 Pro"))[1]
    assert bounds_95(phone_body(known)[1]).mm > bounds_95(sure).mm


@pytest.mark.parametrize(
    ("name", "ruler"),
    [
        ("Galaxy", (147.0, 70.6, 20.0, 15.0)),
        ("Galaxy", (7.06, 14.7, 2.0, 1.5)),
        ("Galaxy", (70.0, 147.0, 20.0, 80.0)),
        ("iPhone 15", (77.8, 160.9, 25.6, 25.6)),
    ],
)
def test_a_ruler_that_cannot_be(name: str, ruler: tuple[float, float, float, float]):
    with pytest.raises(InputError) as caught:
        phone_named(name, ruler)
    assert caught.value.code == "phone-ruler"
