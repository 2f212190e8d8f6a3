"""Picking points on the mesh: by rays, and through the page's own handlers."""

from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

from capture_app.calibration.pick import HOST, PickPage
from capture_app.calibration.picking import POINTS, Picking
from ingest.calibration.phone.body import body_point, phone_named
from omomo_core.motion import ObjectMesh

BOX = trimesh.creation.box((0.4, 0.6, 0.8))
MESH = ObjectMesh(np.array(BOX.vertices), np.array(BOX.faces, np.int64), "box")
DOWN = (0.0, 0.0, -1.0)


def _click(x: float, y: float, direction: tuple[float, float, float] = DOWN) -> SimpleNamespace:
    return SimpleNamespace(ray_origin=(x, y, 2.0), ray_direction=direction)


def test_a_ray_picks_the_nearest_side_only():
    picking = Picking(MESH)
    pair = picking.pick("lens", (0.1, 0.2, 2.0), DOWN)
    assert pair is not None
    np.testing.assert_allclose(pair.object, [0.1, 0.2, 0.4], atol=1e-6)
    assert picking.pick("lens", (0.9, 0.2, 2.0), DOWN) is None
    assert picking.pick("lens", (0.1, 0.2, 2.0), (0.0, 0.0, 1.0)) is None
    assert len(picking.pairs) == 1


def test_a_point_picked_again_moves_and_undo_forgets_the_last():
    picking = Picking(MESH, 0.005)
    for name, x in [("lens", 0.0), ("centre back", 0.1), ("lens", 0.15)]:
        picking.pick(name, (x, 0.0, 2.0), DOWN)
    assert [pair.name for pair in picking.pairs] == ["centre back", "lens"]
    assert picking.pairs[1].object[0] == pytest.approx(0.15)
    assert picking.pairs[0].sigma == 0.005
    assert "lens" not in picking.left
    assert not picking.enough
    picking.undo()
    assert [pair.name for pair in picking.pairs] == ["centre back"]
    picking.undo()
    picking.undo()
    assert picking.pairs == ()


def test_all_points_offered_are_points_of_a_phone():
    phone = phone_named("iPhone 15")
    places = np.array([body_point(phone, name) for name in POINTS])
    assert len(np.unique(places.round(6), axis=0)) == len(POINTS)


def test_the_page_by_its_handlers():
    pytest.importorskip("viser")
    page = PickPage(MESH)
    try:
        assert page.address.startswith(f"http://{HOST}:")
        for x, y in [(0.0, 0.0), (0.1, 0.0), (9.0, 9.0), (0.1, 0.2)]:
            page.click(_click(x, y))  # pyright: ignore[reportArgumentType]
        assert [pair.name for pair in page.picking.pairs] == list(POINTS[:3])
        page.undo()
        assert len(page.picking.pairs) == 2
        page.click(_click(-0.1, 0.2))  # pyright: ignore[reportArgumentType]
        assert page.picking.pairs[2].name == POINTS[2]
        np.testing.assert_allclose(page.picking.pairs[2].object, [-0.1, 0.2, 0.4], atol=1e-6)
        page.finish()
        assert page.wait() == page.picking.pairs
    finally:
        page.close()
