"""The way of somebody who comes for the first time: example, report, motion."""

import json
import re
from urllib.parse import quote

from playwright.sync_api import expect


def test_example_to_motion(tabs, server):
    page = tabs.open(server.url)
    page.get_by_role("button", name="Try the example").click()
    expect(page.get_by_text("This recording is good")).to_be_visible(timeout=90_000)
    assert page.get_by_role("radio", checked=True).count() == 2
    page.get_by_text("More options").click()
    page.get_by_label("Samples", exact=True).fill("1")
    page.get_by_label("Steps of the sampler").fill("2")
    page.get_by_label("Draw a video").uncheck()
    page.get_by_role("button", name="Make the motion").click()
    page.wait_for_url(re.compile(r"#/jobs/[0-9a-f]{16}\?from="))
    expect(page.get_by_text("Putting the hands on the object", exact=True)).to_be_visible()
    page.wait_for_url(re.compile(r"#/results/[0-9a-f]{16}$"), timeout=120_000)
    expect(page.get_by_role("heading", level=1)).to_have_text(re.compile("Example"))
    expect(page.get_by_role("slider", name="Time")).to_be_visible()
    expect(page.get_by_alt_text("What the phone filmed at this moment")).to_be_visible()
    result = server.ask(f"results/{page.url[-16:]}")
    assert (result["samples"], result["manifest"]["options"]["steps"]) == (1, 2)
    assert result["video"] is None


def test_report_says_what_to_do_and_shows_where(tabs, server, shaken):
    page = tabs.open(server.at(f"/sessions/{shaken}"))
    expect(page.get_by_text("This recording is usable with limits")).to_be_visible(timeout=90_000)
    expect(page.get_by_text("To do first:")).to_be_visible()
    worst = page.locator(".checks li").first
    expect(worst).to_contain_text("look")
    expect(worst).to_contain_text("Do:")
    expect(page.locator(".stage-track [role=slider]").first).to_be_visible(timeout=90_000)
    place = page.get_by_role("button", name=re.compile(r"^Show \d")).first
    seconds = float(re.findall(r"[\d.]+", place.inner_text())[0])
    place.click()
    expect(page.locator(".clock")).to_have_text(re.compile(rf"^{seconds:.1f} / "))


def test_a_click_straight_from_a_field_makes_the_motion(tabs, server, example):
    chosen = f"?object={example['object']}&mount={example['mount']}"
    page = tabs.open(server.at(f"/sessions/{example['session']}{chosen}"))
    expect(page.get_by_text("This recording is good")).to_be_visible(timeout=90_000)
    page.get_by_text("More options").click()
    page.get_by_label("Stretch to use").press_sequentially("1")
    # As long as a person presses: meanwhile the field is left, and the recording looked at again.
    page.get_by_role("button", name="Make the motion").click(delay=60)
    page.wait_for_url(re.compile(r"#/jobs/[0-9a-f]{16}\?from="))
    job = page.url.partition("#/jobs/")[2][:16]
    assert server.ask(f"jobs/{job}")["options"]["segment"] == 1
    server.ask(f"jobs/{job}/cancel", {})


def test_a_job_that_fails_tells_why_and_leads_back(tabs, server, example):
    chosen = f"?object={example['object']}&mount={example['mount']}"
    order = {"kind": "run", **example, "options": {"segment": 9, "force": True}}
    back = quote(f"#/sessions/{example['session']}{chosen}", safe="")
    page = tabs.open(server.at(f"/jobs/{server.ask('jobs', order)['id']}?from={back}"))
    alert = page.get_by_role("alert")
    expect(alert).to_contain_text("What to do:", timeout=120_000)
    assert "Traceback" not in page.content()
    page.get_by_role("link", name="Back to the recording").click()
    page.wait_for_url(f"**/sessions/{example['session']}{chosen}")


def test_options_stay_when_one_goes_back(tabs, server, example):
    chosen = f"?object={example['object']}&mount={example['mount']}"
    page = tabs.open(server.at(f"/sessions/{example['session']}{chosen}"))
    page.get_by_label("Samples", exact=True).fill("1")
    page.get_by_text("More options").click()
    page.get_by_label("Steps of the sampler").fill("999")
    page.get_by_label("Draw a video").uncheck()
    page.get_by_label("Which way is up").select_option("direction")
    page.get_by_label("Direction of up").fill("0,1,0")
    page.get_by_label("Direction of up").blur()
    page.get_by_role("button", name="Make the motion").click(timeout=90_000)
    page.wait_for_url(re.compile("#/jobs/"))
    page.go_back()
    expect(page.get_by_label("Samples", exact=True)).to_have_value("1")
    expect(page.get_by_label("Steps of the sampler")).to_be_visible()
    expect(page.get_by_label("Steps of the sampler")).to_have_value("999")
    expect(page.get_by_label("Draw a video")).not_to_be_checked()
    expect(page.get_by_label("Direction of up")).to_have_value("0,1,0")


def test_errors_use_the_words_of_the_page(tabs, server, example):
    chosen = f"?object={example['object']}&mount={example['mount']}"
    page = tabs.open(server.at(f"/sessions/{example['session']}{chosen}"))
    page.get_by_text("More options").click()
    page.get_by_label("Stretch to use").fill("9")
    page.get_by_label("Stretch to use").blur()
    told = page.get_by_text("This recording is not usable: ")
    expect(told).to_be_visible(timeout=90_000)
    expect(page.get_by_text("“Stretch to use”").first).to_be_visible()
    assert not re.search(r"--[a-z]{2}", page.locator("main").inner_text())
    order = {"kind": "run", **example, "options": {"segment": 9, "force": True}}
    page.goto(server.at(f"/jobs/{server.ask('jobs', order)['id']}"))
    expect(page.get_by_role("alert")).to_contain_text("“Stretch to use”", timeout=120_000)
    assert not re.search(r"--[a-z]{2}", page.locator("main").inner_text())


def test_an_object_that_is_chosen_brings_its_mount(tabs, server, example):
    page = tabs.open(server.at(f"/sessions/{example['session']}"))
    page.locator(f"input[value='{example['object']}']").check()
    page.wait_for_url(re.compile(rf"object={example['object']}&mount=[0-9a-f]{{16}}"))
    expect(page.get_by_text("It was made for this object.")).to_be_visible()
    expect(page.get_by_role("button", name="Make the motion")).to_be_enabled(timeout=90_000)


def test_a_motion_is_ordered_of_a_usable_recording_and_a_mount_that_was_chosen(
    tabs, server, example
):
    page = tabs.open(server.at(f"/sessions/{example['session']}?object={example['object']}"))
    make = page.get_by_role("button", name="Make the motion")
    expect(page.get_by_text("Choose the mount first")).to_be_visible(timeout=90_000)
    expect(make).to_be_disabled()
    own = page.get_by_role("radio", name=re.compile("in the phone's own frame"))
    expect(own).not_to_be_checked()
    own.check()
    page.wait_for_url("**mount=identity")
    page.get_by_role("radio", name=re.compile("Example: mount")).check()
    expect(make).to_be_enabled(timeout=90_000)
    more = page.locator("details", has_text="More options")
    more.evaluate("(one) => (one.open = true)")
    page.get_by_label("Stretch to use").fill("9")
    page.get_by_label("Stretch to use").blur()
    expect(page.get_by_text("This recording is not usable: ")).to_be_visible(timeout=90_000)
    expect(make).to_be_disabled()
    page.get_by_label("Stretch to use").fill("1")
    page.get_by_label("Which way is up").select_option("direction")
    page.get_by_label("Direction of up").fill("0,1,0")
    page.get_by_label("Direction of up").blur()
    expect(make).to_be_enabled(timeout=90_000)
    page.get_by_label("Steps of the sampler").fill("1000")
    make.click()
    page.wait_for_url(re.compile(r"#/jobs/[0-9a-f]{16}"))
    options = server.ask(f"jobs/{page.url.partition('#/jobs/')[2][:16]}")["options"]
    assert (options["segment"], options["up"], options["format"]) == (1, [0, 1, 0], None)


def test_an_unusable_recording_is_used_by_force_alone(tabs, server, example):
    chosen = f"?object={example['object']}&mount={example['mount']}"
    page = tabs.open(server.at(f"/sessions/{example['session']}{chosen}"))
    page.get_by_text("More options").click()
    page.get_by_label("Which way is up").select_option("object:-z")
    told = page.get_by_text("This recording is not usable: gravity")
    expect(told).to_be_visible(timeout=90_000)
    make = page.get_by_role("button", name="Make the motion")
    expect(make).to_be_disabled()
    page.get_by_label("Use a recording that is not usable").check()
    expect(make).to_be_enabled()


def test_where_the_phone_saw_them_is_asked_only_with_a_mount(tabs, server, example):
    for mount, asked in ((f"&mount={example['mount']}", True), ("", False)):
        page = tabs.open(
            server.at(f"/sessions/{example['session']}?object={example['object']}{mount}")
        )
        page.get_by_text("More options").click()
        phone = page.get_by_label("They stood before the phone's screen when it began")
        expect(phone).to_be_visible(visible=asked)


def test_names_are_text_and_never_markup(tabs, server, example):
    name = "<img src=x onerror=document.title='owned'>"
    server.ask(f"objects/{example['object']}", {"name": name}, "PATCH")
    try:
        page = tabs.open(server.at("/library"))
        expect(page.get_by_role("link", name=name)).to_be_visible()
        assert page.title() == "Library · omocap"
    finally:
        server.ask(f"objects/{example['object']}", {"name": "Example: box"}, "PATCH")


def test_a_stored_thing_is_renamed_and_deleted_after_asking(tabs, server):
    mount = server.ask("mounts", {"method": "identity", "name": "Old"})
    page = tabs.open(server.at(f"/mounts/{mount['id']}"))
    page.get_by_role("button", name="Rename").click()
    page.get_by_role("textbox", name="Name").fill("New")
    page.keyboard.press("Enter")
    expect(page.get_by_role("heading", level=1)).to_have_text("New")
    page.get_by_role("button", name="Delete").click()
    page.get_by_role("dialog").get_by_role("button", name="Cancel").click()
    assert server.ask(f"mounts/{mount['id']}")["name"] == "New"
    page.get_by_role("button", name="Delete").click()
    page.get_by_role("button", name="Delete it").click()
    page.wait_for_url("**/#/library")
    assert mount["id"] not in json.dumps(server.ask("mounts"))


def test_an_option_appears_on_the_page_without_a_line_of_javascript(tabs, server, example):
    page = tabs.open(server.url)
    answer = server.ask("choices")
    option = {
        "name": "bounce",
        "kind": "number",
        "title": "Bounce",
        "hint": "",
        "group": "more",
        "unit": "m",
    }
    answer["forms"]["run"].append(option)
    page.route("**/api/choices", lambda route: route.fulfill(json=answer))
    page.goto(server.at(f"/sessions/{example['session']}"))
    page.get_by_text("More options").click()
    expect(page.get_by_label("Bounce (m)")).to_be_visible()
