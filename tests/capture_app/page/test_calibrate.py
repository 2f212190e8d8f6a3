"""The mount, found in the page."""

import re

import pytest
from playwright.sync_api import expect

CORNERS = [
    ("top left back", (-3.5, 7.0, -0.8)),
    ("top right back", (3.5, 7.0, -0.8)),
    ("bottom left back", (-3.5, -7.0, -0.8)),
    ("bottom right front", (3.5, -7.0, 0.0)),
]
"""Where they are on the object, centimetres: the phone's middle in the object's origin."""


def _start(tabs, server, example, way):
    back = f"%23%2Fsessions%2F{example['session']}%3Fobject%3D{example['object']}"
    return tabs.open(server.at(f"/calibrate?way={way}&object={example['object']}&back={back}"))


def _use(page, server, example):
    mount = re.search(r"mounts/([0-9a-f]{16})", page.url)[1]
    page.get_by_role("link", name="Use it for the recording").click()
    page.wait_for_url(f"**/sessions/{example['session']}?object={example['object']}&mount={mount}")
    return server.ask(f"mounts/{mount}")


def test_one_way_is_recommended_and_the_others_are_folded_up(tabs, server, example):
    page = tabs.open(server.at(f"/calibrate?object={example['object']}"))
    expect(page.get_by_role("radio", name=re.compile("Board, and only the phone"))).to_be_visible()
    expect(page.get_by_role("radio")).to_have_count(1)
    page.get_by_text("Other ways").click()
    expect(page.get_by_role("radio")).to_have_count(9)
    page.get_by_role("radio", name=re.compile("Click points")).check()
    page.wait_for_url(re.compile("way=points"))
    expect(page.get_by_role("radio", name=re.compile("Click points"))).to_be_focused()


def test_the_phone_that_is_there_first_makes_a_mount(tabs, server, example):
    page = _start(tabs, server, example, "drawing")
    phone = page.get_by_role("combobox", name="Phone", exact=True)
    expect(phone).to_have_value("iPhone 15 Pro")
    expect(page.get_by_label("Main lens from the top edge")).to_be_hidden()
    for axis in "xyz":
        page.get_by_label(f"{axis} (cm)").fill("5")
    page.get_by_role("button", name="Keep this mount").click()
    page.wait_for_url(re.compile("#/mounts/"))


def test_of_a_phone_with_an_unknown_lens_only_the_lens_is_measured(tabs, server, example):
    page = _start(tabs, server, example, "drawing")
    page.get_by_role("combobox", name="Phone", exact=True).select_option("iPhone 17 Pro")
    expect(
        page.get_by_text("Nobody published where the lens of an iPhone 17 Pro is")
    ).to_be_visible()
    expect(page.get_by_label("Width (mm)")).to_have_value("71.85")
    page.get_by_label("Main lens from the top edge").fill("34")
    page.get_by_label("Main lens from the left edge").fill("14")
    for axis in "xyz":
        page.get_by_label(f"{axis} (cm)").fill("5")
    page.get_by_role("button", name="Keep this mount").click()
    page.wait_for_url(re.compile("#/mounts/"))


def test_points_typed_give_a_mount_with_its_error(tabs, server, example):
    page = _start(tabs, server, example, "points")
    page.get_by_role("combobox", name="Phone", exact=True).select_option("iPhone 15 Pro")
    page.get_by_text("Type the place instead of clicking").click()
    for name, place in CORNERS:
        page.get_by_label("This point of the phone").select_option(name)
        for axis, value in zip("xyz", place, strict=True):
            page.get_by_label(f"{axis} (cm)").fill(str(value))
        page.get_by_role("button", name="Add this point").click()
        if name == CORNERS[1][0]:
            expect(
                page.get_by_text(re.compile("cm apart here, .* on the iPhone 15 Pro"))
            ).to_be_visible()
    expect(
        page.get_by_text(re.compile(r"^✓ \d points, which fit the phone within"))
    ).to_be_visible()
    expect(page.get_by_text(re.compile("those of its far end, .* away"))).to_be_visible()
    page.get_by_role("button", name="Keep this mount").click()
    page.wait_for_url(re.compile("#/mounts/"))
    expect(page.get_by_text(re.compile(r"is sure to ± \d+\.\d mm"))).to_be_visible()
    good = r"^What was measured fits to \d\.\d mm on average; a good fit is under 5 mm\.$"
    expect(page.get_by_text(re.compile(good))).to_be_visible()
    mount = _use(page, server, example)
    assert (mount["method"], mount["object"]) == ("points", example["object"])


def test_points_that_do_not_fit_are_told_while_they_are_placed(tabs, server, example):
    page = _start(tabs, server, example, "points")
    page.get_by_text("Type the place instead of clicking").click()
    for k, (name, place) in enumerate(CORNERS):
        page.get_by_label("This point of the phone").select_option(name)
        for axis, value in zip("xyz", place, strict=True):
            page.get_by_label(f"{axis} (cm)").fill(str(value + 4 * (k == 1 and axis == "z")))
        page.get_by_role("button", name="Add this point").click()
    expect(
        page.get_by_text(re.compile("fit the phone to .* mm only|do not fit together"))
    ).to_be_visible()
    expect(page.get_by_text(re.compile(r"^✓"))).to_have_count(0)


def test_numbers_show_the_phone_on_the_object_while_they_are_typed(tabs, server, example):
    page = _start(tabs, server, example, "drawing")
    canvas = page.locator(".stage canvas")
    expect(page.locator(".stage-message p")).to_have_count(0)
    before = canvas.screenshot()
    for axis, value in zip("xyz", (20, 0, 10), strict=True):
        page.get_by_label(f"{axis} (cm)").fill(str(value))
    expect(page.get_by_text(re.compile("those of its far end, .* to .* mm"))).to_be_visible()
    page.wait_for_timeout(1000)
    assert canvas.screenshot() != before


@pytest.mark.slow
def test_points_are_clicked_on_the_object(tabs, server, example):
    page = _start(tabs, server, example, "points")
    canvas = page.locator(".stage canvas")
    # The object is there when nothing is fetched any more, and is drawn a moment later.
    page.wait_for_load_state("networkidle")
    page.wait_for_timeout(1000)
    expect(page.locator(".stage-message p")).to_have_count(0)
    canvas.click(position={"x": 5, "y": 5})
    expect(page.get_by_text("That is beside the object.")).to_be_visible()
    middle = canvas.evaluate("(one) => [one.clientWidth / 2, one.clientHeight / 2]")
    for number, dx in enumerate((-20, 20), 1):
        canvas.click(position={"x": middle[0] + dx, "y": middle[1]})
        expect(page.locator(".pairs li")).to_have_count(number)
    page.get_by_role("button", name="Remove top left back").click()
    expect(page.locator(".pairs li")).to_have_count(1)
    page.get_by_role("button", name="Keep this mount").click()
    expect(page.get_by_role("alert")).to_be_visible()


def test_numbers_by_eye_warn(tabs, server, example):
    page = _start(tabs, server, example, "drawing")
    page.get_by_role("combobox", name="Phone", exact=True).select_option("iPhone 15 Pro")
    for axis, value in zip("xyz", (0, 10, 20), strict=True):
        page.get_by_label(f"{axis} (cm)").fill(str(value))
    page.get_by_label("How do you know").select_option("10")
    page.get_by_role("button", name="Keep this mount").click()
    expect(page.get_by_text("hands may be that far off the object")).to_be_visible()
    assert _use(page, server, example)["bounds"]["mm"] > 20


def test_screen_and_top_edge_along_one_axis_is_refused_in_words(tabs, server, example):
    page = _start(tabs, server, example, "drawing")
    for axis in "xyz":
        page.get_by_label(f"{axis} (cm)").fill("1")
    page.get_by_label("The top edge points").select_option("+z")
    page.get_by_role("button", name="Keep this mount").click()
    expect(page.get_by_role("alert")).to_contain_text("What to do:")


def test_the_mesh_around_the_phone(tabs, server, example):
    page = _start(tabs, server, example, "identity")
    page.get_by_role("button", name="Keep this mount").click()
    page.wait_for_url(re.compile("#/mounts/"))
    assert _use(page, server, example)["method"] == "identity"
