"""What is done with a motion is done with the sample on the screen, and loses nothing on the way."""

import io
import re

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import expect

from capture_app.motion_faults import unsatisfied
from capture_app.result import load_result

STOP = re.compile(r"hand contact 1, stop")


@pytest.fixture
def page(tabs, server, motion):
    page = tabs.open(server.at(f"/results/{motion}"))
    expect(page.get_by_role("slider", name="Time")).to_be_visible(timeout=90_000)
    return page


def _other(server, motion: str) -> int:
    """Index of the sample that is not the best."""
    return 1 - server.ask(f"results/{motion}")["chosen"]


def _show(page, sample: int) -> None:
    page.get_by_label(re.compile(rf"^{sample + 1}( \(best\))?$")).check()
    expect(page.locator(".stage-message p")).to_have_count(0)


def _lengthen(page) -> str | None:
    """Make a contact longer; where it ends then."""
    page.get_by_role("button", name="Correct the contacts").click()
    stop = page.get_by_role("slider", name=STOP).first
    stop.focus()
    page.keyboard.press("PageDown")
    return page.get_by_role("slider", name=STOP).first.get_attribute("aria-valuenow")


def test_files_and_videos_are_of_the_sample_that_is_shown(page, server, motion):
    other = _other(server, motion)
    _show(page, other)
    expect(page.get_by_text(f"Of sample {other + 1}.", exact=True)).to_be_visible(timeout=60_000)
    assert server.ask(f"results/{motion}")["unsolved"] == []
    page.get_by_label("Format").select_option("csv")
    page.get_by_role("button", name="Make the file").click()
    link = page.get_by_role("status").get_by_role("link").first
    expect(link).to_have_text(re.compile(f"-sample{other + 1}-"), timeout=120_000)
    page.get_by_label("All side by side").check()
    expect(page.get_by_text(f"Of sample {other + 1}.")).to_be_visible()
    page.get_by_text("Seen from elsewhere").click()
    page.get_by_role("button", name="Draw the video").click()
    page.wait_for_url(re.compile(r"#/jobs/"))
    job = server.ask(f"jobs/{page.url.partition('#/jobs/')[2][:16]}")
    assert job["options"]["sample"] == other + 1


def test_what_is_told_is_of_the_sample_that_is_shown(page, server, motion):
    """Faults and grips are those of the sample on the screen; a click on one, or on its mark, goes there."""
    card = page.locator("section", has=page.get_by_role("heading", name="Good to know"))
    for sample in (1 - _other(server, motion), _other(server, motion)):
        _show(page, sample)
        expect(card.get_by_role("heading", level=3)).to_have_text(f"Sample {sample + 1}")
        expect(page.get_by_text(f"Of sample {sample + 1}.", exact=True)).to_be_visible(
            timeout=60_000
        )
        expect(card.get_by_text("is known when it is finished")).to_have_count(0)
        told = _told(server, motion, sample)
        placed = [text for text in told if text.startswith("From ")]
        marks = page.locator(".tl-reports .tl-flag")
        expect(marks).to_have_count(len(placed))
        expect(card.get_by_text("Every palm is where it should be")).to_have_count(int(not told))
        if not placed:
            continue
        expect(card.locator("ul.told").last.locator("li")).to_have_text(told)
        start = float(placed[0].split()[1])
        time = page.get_by_role("slider", name="Time")
        card.locator("ul.told").last.get_by_role("button", name=placed[0]).click()
        expect(time).to_have_attribute("aria-valuenow", str(round(30 * start)))
        page.keyboard.press("Home")
        time.focus()
        page.keyboard.press("Home")
        marks.first.click()
        expect(time).to_have_attribute("aria-valuenow", str(round(30 * start)))
    expect(page.locator(".tl-scale").first).to_have_text(re.compile(r"^\d+\.\d cm$"))


def _told(server, motion: str, sample: int) -> list[str]:
    folder = server.library / "results" / motion
    result = load_result(folder if (folder / "manifest.json").is_file() else folder / "files")
    said = list(unsatisfied(result.people[sample]))
    general = [text for text in result.manifest.faults if not text.startswith("From ")]
    return [*said, *(general if sample == result.manifest.chosen else [])]


def test_the_sample_that_is_shown_is_corrected(page, server, motion):
    other = _other(server, motion)
    _show(page, other)
    _lengthen(page)
    page.get_by_role("button", name="Keep it as a new motion").click()
    page.wait_for_url(re.compile(r"#/results/(?!" + motion + ")"), timeout=120_000)
    made = server.ask(f"results/{page.url[-16:]}")
    assert made["manifest"]["correction"]["sample"] == other
    page.goto(server.at(f"/results/{motion}"))
    expect(page.get_by_role("button", name="Correct the contacts")).to_be_visible(timeout=90_000)
    _show(page, other)
    expect(page.get_by_role("button", name="Correct the contacts")).to_be_visible()


def test_corrections_are_kept_until_they_are_thrown_away(page, server, motion):
    best, other = 1 - _other(server, motion), _other(server, motion)
    end = _lengthen(page)
    stop = page.get_by_role("slider", name=STOP).first
    _show(page, other)
    expect(page.get_by_role("button", name="Correct the contacts")).to_be_visible()
    _show(page, best)
    expect(page.get_by_text("your corrections of last time")).to_be_visible()
    expect(stop).to_have_attribute("aria-valuenow", end)
    page.get_by_role("link", name="Library").click()
    page.wait_for_url("**/#/library")
    page.go_back()
    expect(stop).to_have_attribute("aria-valuenow", end, timeout=90_000)
    expect(page.get_by_role("button", name="Keep it as a new motion")).to_be_enabled()
    page.get_by_role("button", name="Stop correcting").click()
    page.get_by_role("dialog").get_by_role("button", name="Cancel").click()
    expect(stop).to_have_attribute("aria-valuenow", end)
    page.get_by_role("button", name="Stop correcting").click()
    page.get_by_role("button", name="Throw them away").click()
    expect(page.get_by_role("button", name="Correct the contacts")).to_be_focused()
    page.reload()
    expect(page.get_by_role("button", name="Correct the contacts")).to_be_visible(timeout=90_000)


def test_the_picture_goes_where_a_contact_is_moved_and_keys_take_it_back(page):
    end = _lengthen(page)
    time = page.get_by_role("slider", name="Time")
    expect(time).to_have_attribute("aria-valuenow", str(int(end) - 1))
    stop = page.get_by_role("slider", name=STOP).first
    expect(stop).to_be_focused()
    page.keyboard.press("Control+z")
    expect(page.get_by_role("button", name="Keep it as a new motion")).to_be_disabled()
    page.keyboard.press("Control+y")
    expect(stop).to_have_attribute("aria-valuenow", end)
    expect(page.get_by_role("button", name="Keep it as a new motion")).to_be_enabled()
    # A drag is one step, wherever the focus is.
    box = stop.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    for step in (20, 60, 40):
        page.mouse.move(box["x"] - step, box["y"] + box["height"] / 2)
    page.mouse.up()
    dragged = stop.get_attribute("aria-valuenow")
    assert int(dragged) < int(end)
    expect(time).to_have_attribute("aria-valuenow", str(int(dragged) - 1))
    page.locator(".stage canvas").first.focus()
    page.keyboard.press("Control+z")
    expect(stop).to_have_attribute("aria-valuenow", end)


def test_playhead_and_clock_agree_after_another_sample_is_shown(page, server, motion):
    time = page.get_by_role("slider", name="Time")
    time.focus()
    for _ in range(3):
        page.keyboard.press("PageUp")
    _show(page, _other(server, motion))
    expect(page.locator(".clock")).to_have_text(re.compile(r"^3\.0 /"))
    expect(time).to_have_attribute("aria-valuenow", "90")
    assert page.locator(".tl-rows").evaluate("(one) => one.style.getPropertyValue('--at')") != "0"


def test_the_space_bar_plays_and_pauses(page, server, motion):
    _show(page, _other(server, motion))
    page.keyboard.press("Space")
    expect(page.get_by_role("button", name="Pause", exact=True)).to_be_visible()
    page.locator(".stage canvas").first.focus()
    page.keyboard.press("Space")
    expect(page.get_by_role("button", name="Play", exact=True)).to_be_visible()
    # On a button a space is the button's.
    page.get_by_role("button", name="Rename").press("Space")
    expect(page.get_by_role("dialog")).to_be_visible()
    expect(page.get_by_role("button", name="Play", exact=True)).to_be_visible()


def test_the_camera_follows_the_person_who_fills_half_the_height(page):
    expect(page.get_by_role("combobox", name="Camera")).to_have_value("follow")
    page.locator(".layers summary", has_text="Show").click()
    layers = ("Object", "Contacts", "Phone", "Phone's path", "Object's trail", "Floor", "Shadow")
    for layer in layers:
        page.get_by_role("checkbox", name=layer, exact=True).uncheck()
    page.locator(".layers summary", has_text="Show").click()
    time = page.get_by_role("slider", name="Time")
    for second in (0, 3, 6, 9):
        time.focus()
        page.keyboard.press("Home")
        for _ in range(second):
            page.keyboard.press("PageUp")
        top, bottom, middle = _extent(page)
        assert 0.35 < bottom - top < 0.65
        assert 0.35 < middle < 0.65


def _extent(page) -> tuple[float, float, float]:
    """Of the person in the picture: upper end, lower end and middle across, shares of the picture."""
    canvas = page.locator(".stage canvas").first
    shown = np.asarray(Image.open(io.BytesIO(canvas.screenshot())).convert("RGB"), float)
    height, width, _ = shown.shape
    # The body is the one thing that is much more blue than red; the phone's film is in a corner.
    blue = (shown[..., 2] - shown[..., 0] > 25) & (np.arange(width) < 0.75 * width)
    rows, columns = np.nonzero(blue)
    return rows.min() / height, rows.max() / height, columns.mean() / width


def test_the_shared_file_opens_on_the_sample_that_was_shown(page, server, motion, tabs):
    other = _other(server, motion)
    _show(page, other)
    with page.expect_download() as taken:
        page.get_by_role("link", name="Download to share").click()
    shared = tabs.context.new_page()
    shared.set_content(taken.value.path().read_text())
    select = shared.get_by_role("combobox", name="Sample", exact=True)
    expect(select).to_have_value(str(other))
    expect(select.locator("option:checked")).to_have_text(f"Sample {other + 1}")


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (1024, 768)])
def test_correcting_fits_the_window(page, width: int, height: int):
    page.set_viewport_size({"width": width, "height": height})
    page.get_by_role("button", name="Correct the contacts").click()
    for part in (".stage canvas", ".stage-tracks"):
        box = page.locator(part).first.bounding_box()
        assert box["y"] >= 56
        assert box["y"] + box["height"] <= height
    for name in ("Keep it as a new motion", "Stop correcting", "Add left"):
        box = page.get_by_role("button", name=name).bounding_box()
        assert box["y"] + box["height"] <= height


def test_a_film_that_shows_nobody_is_told_before_it_is_drawn(page):
    page.get_by_text("The person in a film of the take").click()
    film = page.get_by_role("combobox", name="Into")
    expect(film).to_have_value("other")
    film.select_option("own")
    expect(page.get_by_text(re.compile("films them at no time|films them in . %"))).to_be_visible()
