"""An object is cut out of the mesh of a room by a click on it."""

import re

from playwright.sync_api import Page, expect

from tests.capture_app.page.choosing import choose
from tests.textured_room import room, write_room


def _brought(page: Page, tmp_path, places) -> None:
    page.get_by_label("Filmed with").select_option("room")
    choose(page, "Drop the room's mesh here", write_room(tmp_path / "room.glb", room(places)))
    expect(page.get_by_text("Click on the object.")).to_be_visible(timeout=120_000)
    # The room is there when nothing is fetched any more, and is drawn a moment later.
    page.wait_for_load_state("networkidle")
    page.wait_for_timeout(1500)
    expect(page.locator(".stage-message p")).to_have_count(0)


def test_a_click_on_the_object_cuts_it_out_of_the_room(tabs, server, tmp_path):
    page = tabs.open(server.at("/scan"))
    _brought(page, tmp_path, ((0.0, 0.0),))
    canvas = page.locator(".stage canvas")
    canvas.click(position={"x": 3, "y": 3})
    expect(page.get_by_text("That is beside the room.")).to_be_visible()
    middle = canvas.evaluate("(one) => [one.clientWidth / 2, one.clientHeight / 2]")
    canvas.click(position={"x": middle[0], "y": middle[1]})
    expect(page.locator(".pairs li")).to_have_count(1)
    page.get_by_role("button", name="Make the object").click()
    page.wait_for_url(re.compile(r"#/objects/"), timeout=90_000)
    made = server.ask(f"objects/{page.url[-16:]}")
    assert 0.5 < max(made["extents"]) < 0.9
    assert made["scan"]["severity"] == "ok"


def test_without_a_click_one_of_several_is_asked_for_in_words(tabs, server, tmp_path):
    page = tabs.open(server.at("/scan"))
    _brought(page, tmp_path, ((0.0, 0.0), (1.2, 1.2)))
    page.get_by_role("button", name="Make the object").click()
    page.wait_for_url(re.compile(r"#/jobs/"))
    alert = page.get_by_role("alert")
    expect(alert).to_contain_text("2 things stand on the floor", timeout=90_000)
    expect(alert).to_contain_text("a point on it (“The place”)")
