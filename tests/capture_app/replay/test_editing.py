"""Contacts that are edited on the page are a file that `omocap resolve` reads."""

from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import expect

from omomo_core.contact.contact_file import read_contacts
from omomo_core.geometry.surface import sample_surface
from omomo_core.motion import FPS
from tests.capture_app.replay.conftest import OpenPage
from tests.capture_app.replay.made import FRAMES


def test_edited_contacts_are_a_file_that_resolve_reads(
    open_page: OpenPage, packs, made, tmp_path: Path
) -> None:
    page = open_page(packs[0])
    page.get_by_role("button", name="Correct the contacts").click()
    stop = page.get_by_role("slider", name="Left hand contact 1, stop")
    stop.scroll_into_view_if_needed()
    box, lane = stop.bounding_box(), page.locator(".tl-lane").first.bounding_box()
    assert box is not None
    assert lane is not None
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 2, y)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] / 2 - 8 * lane["width"] / FRAMES, y, steps=6)
    page.mouse.up()
    page.evaluate(f"replay.viewer.seek({28 / FPS})")
    page.get_by_role("button", name="Add left").click()
    place = page.evaluate("Array.from(replay.viewer.pack(0).array('object_position').slice(0, 3))")
    page.evaluate("replay.viewer.camera('object'); replay.viewer.seek(0)")
    spot = page.evaluate(f"replay.viewer.project({place})")
    page.locator("#view").click(position={"x": spot["x"], "y": spot["y"]})
    with page.expect_download() as saving:
        page.get_by_role("button", name="Save the contacts").click()
    file = tmp_path / "contacts.json"
    saving.value.save_as(file)
    spans = read_contacts(file, FRAMES, sample_surface(made.object_motion.mesh))
    told = [(s.hand, s.start, s.stop) for s in spans]
    assert told == [(0, 5, 22), (1, 5, 30), (0, 28, FRAMES)]
    own = made.people[0].segments[0].anchor
    np.testing.assert_allclose(spans[0].anchor, own, atol=1e-5)
    half = made.object_motion.mesh.vertices.max(axis=0)
    outside = np.maximum(np.abs(spans[2].anchor) - half, 0)
    assert np.linalg.norm(outside) == pytest.approx(0.02, abs=1e-4)


def test_contacts_keep_their_distance_and_can_be_undone(open_page: OpenPage, packs) -> None:
    page = open_page(packs[0])
    page.get_by_role("button", name="Correct the contacts").click()
    whole = "replay.timeline.contacts"
    before = page.evaluate(whole)
    page.evaluate(f"replay.viewer.seek({20 / FPS})")
    page.get_by_role("button", name="Add right").click()
    expect(page.locator(".tl-status")).to_contain_text("no room")
    page.evaluate(f"replay.viewer.seek({34 / FPS})")
    page.get_by_role("button", name="Add right").click()
    bar = page.get_by_role("button", name="Right hand contact 2")
    for _ in range(6):
        bar.press("ArrowLeft")
    ends = [
        (s["start"], s["stop"]) for s in page.evaluate(whole)["segments"] if s["hand"] == "right"
    ]
    assert ends == [(5, 30), (33, 39)]
    assert page.evaluate("replay.timeline.dirty")
    page.get_by_role("button", name="Reset").click()
    assert page.evaluate(whole) == before
    assert not page.evaluate("replay.timeline.dirty")
    page.get_by_role("button", name="Undo").click()
    assert page.evaluate(whole) != before
