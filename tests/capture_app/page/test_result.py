"""A motion: looked at, its contacts corrected, compared, taken to other programs."""

import io
import json
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import expect

from benchmarks.characters import WrittenGlb
from tests.capture_app.page.choosing import choose
from tests.rigs import KINDS, make_rig, write_rig


@pytest.fixture
def result_page(tabs, server, motion):
    page = tabs.open(server.at(f"/results/{motion}"))
    expect(page.get_by_role("slider", name="Time")).to_be_visible(timeout=90_000)
    return page


def _clock(page) -> float:
    return float(page.locator(".clock").inner_text().split("/")[0])


def test_scrub_and_play(result_page):
    time = result_page.get_by_role("slider", name="Time")
    time.focus()
    for _ in range(3):
        result_page.keyboard.press("PageUp")
    expect(result_page.locator(".clock")).to_have_text(re.compile(r"^3\.0 /"))
    result_page.keyboard.press("Home")
    expect(result_page.locator(".clock")).to_have_text(re.compile(r"^0\.0 /"))
    result_page.get_by_role("combobox", name="Speed").select_option("2")
    result_page.get_by_role("button", name="Play", exact=True).click()
    result_page.wait_for_function(
        "() => parseFloat(document.querySelector('.clock').textContent) > 0.5"
    )
    result_page.get_by_role("button", name="Pause", exact=True).click()
    stopped = _clock(result_page)
    result_page.wait_for_timeout(300)
    assert _clock(result_page) == stopped


@pytest.mark.slow
def test_samples_are_shown_one_by_one_or_side_by_side(result_page):
    result_page.get_by_label("All side by side").check()
    expect(result_page.locator(".stage-names span")).to_have_text(["Sample 1", "Sample 2"])
    expect(result_page.get_by_role("slider", name="Time")).to_have_count(2)
    expect(result_page.get_by_role("button", name="Correct the contacts")).to_be_hidden()
    result_page.get_by_label("best").check()
    expect(result_page.get_by_role("slider", name="Time")).to_have_count(1)
    expect(result_page.get_by_role("button", name="Correct the contacts")).to_be_visible()


def test_corrected_contact_is_solved_again_and_compared(result_page, server, motion):
    page = result_page
    before = server.ask(f"results/{motion}/contacts")["segments"]
    page.get_by_role("button", name="Correct the contacts").click()
    solve = page.get_by_role("button", name="Keep it as a new motion")
    expect(solve).to_be_disabled()
    page.get_by_role("slider", name=re.compile(r"hand contact 1, stop")).first.focus()
    page.keyboard.press("PageDown")
    solve.click()
    page.wait_for_url(re.compile(r"#/jobs/"))
    page.wait_for_url(re.compile(r"#/results/"), timeout=120_000)
    corrected = page.url[-16:]
    after = server.ask(f"results/{corrected}/contacts")["segments"]
    assert len(after) == len(before)
    assert sum(a != b for a, b in zip(before, after, strict=True)) == 1
    assert server.ask(f"results/{corrected}")["parent"] == motion
    page.get_by_role("link", name="compare the two").click()
    names = ["The motion", "The motion, corrected"]
    expect(page.locator(".stage-names span")).to_have_text(names, timeout=90_000)
    assert page.get_by_role("checkbox", checked=True).count() >= 2
    first, second = page.get_by_role("slider", name="Time").all()
    first.focus()
    page.keyboard.press("PageUp")
    expect(second).to_have_attribute("aria-valuenow", first.get_attribute("aria-valuenow"))


def test_export_is_made_and_downloaded(result_page):
    page = result_page
    page.get_by_label("Format").select_option("bvh")
    page.get_by_text("Options", exact=True).click()
    page.get_by_label("Frames a second").select_option("60")
    page.get_by_role("button", name="Make the file").click()
    link = page.get_by_role("status").get_by_role("link").first
    expect(link).to_be_visible(timeout=120_000)
    with page.expect_download() as taken:
        link.click()
    lines = taken.value.path().read_text().splitlines()
    assert lines[0] == "HIERARCHY"
    assert any(line.startswith("Frame Time: 0.0166") for line in lines)


def _magenta(page) -> np.ndarray:
    """(height, width) where the picture is as magenta as the character."""
    buffer = io.BytesIO(page.locator(".stage-frame canvas").screenshot())
    red, green, blue = np.array(Image.open(buffer).convert("RGB"), int).transpose(2, 0, 1)
    return np.minimum(red, blue) - green > 60


def test_a_character_of_ones_own_is_dropped_and_comes_back_moving(result_page, tmp_path):
    page, rig = result_page, make_rig(replace(KINDS["unreal"], size=0.5))
    page.get_by_label("Format").select_option("glb")
    page.get_by_text("Options", exact=True).click()
    hero = write_rig(rig, tmp_path / "hero.glb", color=(0.7, 0.02, 0.7))
    # What the phone filmed is of every colour.
    page.locator(".stage-film").evaluate("film => film.remove()")
    assert not _magenta(page).any()
    choose(page, "Drop your own character here", hero)
    link = page.get_by_role("status").get_by_role("link").first
    expect(link).to_be_visible(timeout=120_000)
    expect(page.get_by_role("status").locator(".note")).to_contain_text("does not reach everywhere")
    with page.expect_download() as taken:
        link.click()
    made = WrittenGlb(taken.value.path(), 30)
    assert made.scene["nodes"][made.names["shoes"]]["skin"] == 0
    pelvis = made.names[rig.names[rig.joints["pelvis"]]]
    assert np.ptp(made.world(pelvis, moved=True)[:, :3, 3], axis=0).max() > 0.2
    person = page.locator(".stage-bar").get_by_label(re.compile("^PersonCharacter"))
    expect(person).to_be_visible()
    first = _magenta(page)
    assert first.sum() > 200
    page.get_by_role("slider", name="Time").focus()
    page.keyboard.press("End")
    assert (_magenta(page) != first).sum() > 100
    person.select_option("Our body")
    assert not _magenta(page).any()


def test_a_character_that_cannot_be_shown_is_told_in_a_sentence(result_page, tmp_path):
    page, rig = result_page, make_rig(KINDS["mixamo"])
    unnamed = replace(rig, names=tuple(f"bone {k}" for k in range(len(rig.names))))
    page.get_by_text("Options", exact=True).click()
    choose(page, "Drop your own character here", write_rig(unnamed, tmp_path / "odd.glb"))
    expect(page.get_by_role("alert").or_(page.locator(".trouble")).first).to_contain_text("bone")
    expect(page.locator(".stage-bar").get_by_label(re.compile("^PersonCharacter"))).to_be_hidden()


def test_fbx_is_offered_only_where_there_is_a_blender(tabs, server, motion):
    offered = [export["to"] for export in server.ask("choices")["exports"]]
    page = tabs.open(server.at(f"/results/{motion}"))
    expect(page.get_by_label("Format")).to_be_visible()
    options = page.get_by_label("Format").locator("option")
    values = options.evaluate_all("(all) => all.map((one) => one.value)")
    assert values == offered
    assert ("fbx" in values) == (shutil.which("blender") is not None)


def test_shared_file_holds_the_motion(result_page, tabs):
    with result_page.expect_download() as taken:
        result_page.get_by_role("link", name="Download to share").click()
    text = taken.value.path().read_text()
    assert text.lower().startswith("<!doctype html>")
    assert json.dumps("http")[1:-1] + "://cdn" not in text
    assert taken.value.suggested_filename == "the-motion.html"
    shared = tabs.context.new_page()
    shared.set_content(text)
    expect(shared.get_by_role("heading", level=1)).to_have_text("The motion")
    expect(shared).to_have_title("The motion · replay")
    for words in ("Follow the person", "Correct the contacts", "From above"):
        expect(shared.get_by_role("button", name=words)).to_be_visible()


def test_made_again_from_where_the_person_stood(result_page, server, motion):
    page = result_page
    page.get_by_role("combobox", name="Camera", exact=True).select_option("object")
    page.get_by_role("button", name="They stood elsewhere").click()
    expect(page.locator(".clock")).to_have_text(re.compile(r"^0\.0 /"))
    make = page.get_by_role("button", name="Make it again from there")
    expect(make).to_be_disabled()
    canvas = page.locator(".stage canvas").first
    size = canvas.bounding_box()
    canvas.click(position={"x": size["width"] * 0.45, "y": size["height"] * 0.6})
    expect(page.get_by_role("main").get_by_text("They will start at the post")).to_be_visible()
    x = page.get_by_label("Place, x")
    clicked = x.input_value()
    # Turning the view is no click; elsewhere in time the view goes back first.
    canvas.hover(position={"x": 30, "y": 30})
    page.mouse.down()
    page.mouse.move(size["x"] + 90, size["y"] + 60)
    page.mouse.up()
    assert x.input_value() == clicked
    x.fill("40")
    expect(make).to_be_disabled()
    x.fill("0.75")
    page.get_by_label("The place is where they were").select_option("side")
    expect(x).to_have_value("")
    expect(page.locator(".clock")).not_to_have_text(re.compile(r"^0\.0 /"))
    page.get_by_role("button", name="The other side").click()
    expect(page.get_by_role("main").get_by_text("They will hold it from the side")).to_be_visible()
    page.get_by_label("Hands that hold it").select_option("right")
    page.get_by_label("The place is where they were").select_option("stood")
    expect(x).to_have_value("0.75")
    make.click()
    page.wait_for_url(re.compile(r"#/jobs/"))
    page.wait_for_url(re.compile(r"#/results/"), timeout=120_000)
    before, after = (server.ask(f"results/{id_}") for id_ in (motion, page.url[-16:]))
    now = after["manifest"]["options"]
    assert now["stood"][0] == 0.75
    assert now["hands"] == "right"
    said = {key: now[key] for key in ("stood", "side", "hands")}
    assert now == before["manifest"]["options"] | said
    assert len(now["side"]) == 2
    assert (after["session"], after["object"], after["mount"]) == (
        before["session"], before["object"], before["mount"],
    )  # fmt: skip
