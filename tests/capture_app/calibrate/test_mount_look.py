"""What is implied by a mount that is still typed or clicked."""

import re

import numpy as np

from capture_app.calibration.mount_look import look_at, look_at_points
from capture_app.commands.calibrate import DrawingWay
from capture_app.simulator.demo_take import box_mesh, clamped_phone
from ingest.calibration.phone_body import body_point, phone_body, phone_named
from ingest.calibration.point_pairs import PointPair
from omomo_core.geometry.transforms import inverse

PHONE = phone_named("iPhone 15 Pro")
NAMES = ("top left back corner", "top right back corner", "bottom left back corner", "lens")


def pairs(count: int, wrong: float = 0.0) -> list[PointPair]:
    """Points of the phone as they are on the object, the last one moved by metres."""
    T = inverse(clamped_phone().T_phone_object) @ phone_body(PHONE)[0]
    places = [(T @ [*body_point(PHONE, name), 1])[:3] for name in NAMES[:count]]
    places[-1] = places[-1] + [wrong, 0, 0]
    return [
        PointPair(name, tuple(place.tolist()), 0.002)
        for name, place in zip(NAMES, places, strict=False)
    ]


def test_two_points_say_how_far_apart_they_are():
    right = look_at_points(pairs(2), PHONE, None)
    apart = [
        PointPair(name, (x, 0.0, 0.0), 0.002) for name, x in zip(NAMES, (0.0, 0.114), strict=False)
    ]
    wrong = look_at_points(apart, PHONE, None)
    assert right.mount is None
    assert right.finding.doubts == ()
    assert "apart here, 7.1 cm on the iPhone 15 Pro." in right.finding.notes[0]
    assert "11.4 cm apart here, 7.1 cm on" in wrong.finding.doubts[0]


def test_points_that_do_not_fit_are_doubted_and_the_worst_is_named():
    good = look_at_points(pairs(4), PHONE, box_mesh())
    assert good.finding.doubts == ()
    assert good.finding.good == "4 points, which fit the phone within 0.0 mm (worst 0.0)"
    bad = look_at_points(pairs(4, 0.05), PHONE, box_mesh())
    assert "mm only; clicked with care they fit to 5 mm" in bad.finding.doubts[0]
    assert "'lens'" in " ".join(bad.finding.doubts)


def test_a_ruler_counts_more_the_farther_the_object_reaches():
    way = DrawingWay(
        phone="iPhone 15 Pro",
        xyz=(0.2, 0, 0.1),
        axes="screen faces +z, top edge points +y",
        sigma_mm=3,
        sigma_deg=3,
    )
    looked = look_at(way, box_mesh())
    assert looked.mount is not None
    near, far = (float(n) for n in re.findall(r"to (\d+) mm", looked.finding.notes[0]))
    reach = np.linalg.norm(
        box_mesh().vertices - inverse(looked.mount.T_phone_object)[:3, 3], axis=1
    ).max()
    # Three degrees of one sigma about each axis, and three millimetres along each, at 95 %.
    draws = np.random.default_rng(1).normal(size=(200_000, 3))
    off = np.linalg.norm(np.cross(np.radians(3) * draws, [0, 0, reach]), axis=1)
    assert far > near
    # The turn is about the point that was measured, which is nearer than the lens may be.
    assert 0.9 * np.quantile(off, 0.95) < far / 1e3 < 1.5 * np.quantile(off, 0.95)
