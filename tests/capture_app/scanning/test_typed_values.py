"""Boxes and lengths as they are typed."""

from pathlib import Path

import numpy as np
import pytest

from capture_app.commands.request import validated
from capture_app.commands.scan import ScanRequest
from ingest.scan.cameras.features import Length, Sight, picked_length
from omomo_core.errors import InputError

ASKED = {"source": Path("film"), "output": Path("chair.glb")}


def test_a_box_in_any_order_of_its_corners():
    request = validated(ScanRequest, {**ASKED, "box": "1,0.5,2,-1,0,0.25"}, "invalid")
    box = request.given_box
    assert box is not None
    np.testing.assert_array_equal(box.low, [-1, 0, 0.25])
    np.testing.assert_array_equal(box.high, [1, 0.5, 2])
    assert validated(ScanRequest, ASKED, "invalid").given_box is None


@pytest.mark.parametrize("text", ["1,2,3", "1,2,3,4,5,high", "1,2,3,4,5,nan", ""])
def test_what_is_no_box_is_refused(text: str):
    with pytest.raises(InputError) as caught:
        validated(ScanRequest, {**ASKED, "box": text}, "invalid")
    assert (caught.value.code, caught.value.where) == ("scan-box", "‹box›")


def test_a_length_between_two_picked_points():
    assert picked_length("0.84:00012,310,420;00031,205.5,411:00012,330,80;00031,214,66") == Length(
        0.84,
        (Sight("00012", 310.0, 420.0), Sight("00031", 205.5, 411.0)),
        (Sight("00012", 330.0, 80.0), Sight("00031", 214.0, 66.0)),
    )
