"""What a scan's report says when something is wrong with the film."""

from dataclasses import replace

import numpy as np

from capture_app.scanning.scan_report import circle
from ingest.scan.scan_quality import coverage_of, inspect_scan
from ingest.scan.scan_types import LeftOut, Scale
from ingest.scan.scanned_object import to_height


def _check(found, name):
    return next(check for check in inspect_scan(found).checks if check.name == name)


def _with(found, **changes):
    return replace(found, registered=replace(found.registered, **changes))


def test_a_film_of_one_side_says_from_where_to_film_again(scanned):
    found = scanned.scan.found
    around = coverage_of(found).azimuth
    half = tuple(v for v, a in zip(found.registered.views, around, strict=True) if a < 170)
    one_side = _with(found, views=half)
    start, width = coverage_of(one_side).gap
    assert 130 < start < 171
    assert width > 180
    check = _check(one_side, "all around")
    assert check.severity == "bad"
    assert f"from {start:.0f} to" in check.fix
    assert 'class="gap"' in circle(coverage_of(one_side))
    assert _check(found, "all around").severity == "ok"
    assert 'class="gap"' not in circle(coverage_of(found))


def test_a_plain_object_in_a_busy_room_is_told(scanned):
    found = scanned.scan.found
    T = found.cleaned.T_world_object
    away = np.linalg.norm((found.registered.points - T[:3, 3])[:, :2], axis=1) > 0.5
    assert away.sum() > 100
    room = {"points": found.registered.points[away], "colours": found.registered.colours[away]}
    check = _check(_with(found, **room), "texture")
    assert check.severity == "warn"
    assert "Textureless" in check.fix
    well = _check(found, "texture")
    assert well.severity == "ok", well.message


def test_pictures_that_are_left_out_and_a_size_that_is_not_sure(scanned):
    found = scanned.scan.found
    many = tuple(LeftOut(f"{k}.jpg", "it is dark") for k in range(40))
    assert _check(_with(found, left_out=many), "registered").severity == "warn"
    vague = _with(found, scale=Scale(0.03, "board", "the board"))
    assert _check(vague, "scale").severity == "warn"


def test_the_height_scales_everything_where_nothing_else_tells_the_size(scanned):
    found = scanned.scan.found
    assert to_height(found, 0.9) is found
    guessed = _with(found, scale=Scale(0.5, "height", "the object's height"))
    tall = to_height(guessed, 0.9)
    np.testing.assert_allclose(np.ptp(tall.cleaned.mesh.vertices[:, 2]), 0.9)
    assert tall.registered.scale.sigma < 0.02
    before, after = coverage_of(guessed), coverage_of(tall)
    np.testing.assert_allclose(after.azimuth, before.azimuth, atol=1e-6)
    np.testing.assert_allclose(after.distance, before.distance * tall.stretched)
