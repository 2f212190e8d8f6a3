"""Boxes and lengths as they are typed."""

import numpy as np

from capture_app.scanning.words import given_box, picked_length
from ingest.scan.cameras.options import Length, Sight


def test_a_box_in_any_order_of_its_corners():
    box = given_box("1,0.5,2,-1,0,0.25")
    assert box is not None
    np.testing.assert_array_equal(box.low, [-1, 0, 0.25])
    np.testing.assert_array_equal(box.high, [1, 0.5, 2])
    assert given_box(None) is None


def test_a_length_between_two_picked_points():
    assert picked_length("0.84:00012,310,420;00031,205.5,411:00012,330,80;00031,214,66") == Length(
        0.84,
        (Sight("00012", 310.0, 420.0), Sight("00031", 205.5, 411.0)),
        (Sight("00012", 330.0, 80.0), Sight("00031", 214.0, 66.0)),
    )
