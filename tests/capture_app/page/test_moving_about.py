"""Addresses, back, two tabs, a server that goes away, and no mouse at all."""

import re

from playwright.sync_api import expect

SLOW = {"samples": 4, "steps": 1000, "video": False}


def test_back_goes_through_what_was_chosen(tabs, server, example):
    page = tabs.open(server.url)
    page.get_by_role("link", name="Library").click()
    page.get_by_role("link", name="Example: carried box").or_(
        page.locator(f"a[href='#/sessions/{example['session']}']")
    ).first.click()
    page.get_by_role("radio", name=re.compile("Example: box")).check()
    page.wait_for_url(re.compile(f"object={example['object']}"))
    page.go_back()
    expect(page.get_by_role("radio", name=re.compile("Example: box"))).not_to_be_checked()
    page.go_back()
    expect(page.get_by_role("heading", level=1)).to_have_text("Library")
    page.go_forward()
    expect(page.get_by_role("heading", level=1)).to_have_text(re.compile("Example"))


def test_two_tabs_see_the_same_job_and_one_cancels_it(tabs, server, example):
    order = {"kind": "run", "name": "Long", **example, "options": SLOW}
    job = server.ask("jobs", order)["id"]
    first, second = tabs.open(server.at(f"/jobs/{job}")), tabs.open(server.url)
    second.get_by_role("link", name="1 job at work").click()
    expect(second.get_by_role("button", name="Cancel")).to_be_visible()
    first.get_by_role("button", name="Cancel").click()
    for tab in (first, second):
        expect(tab.get_by_role("main").get_by_text("Cancelled")).to_be_visible(timeout=90_000)
        expect(tab.get_by_role("button", name="Begin again")).to_be_visible()
    assert job not in [one["id"] for one in server.ask("results")]


def test_unknown_addresses_are_told_calmly(tabs, server):
    page = tabs.open(server.at("/results/0123456789abcdef"))
    expect(page.get_by_role("heading", level=1)).to_have_text("This is not here")
    page.goto(server.at("/nowhere"))
    expect(page.get_by_role("alert")).to_contain_text("There is no such page.")
    page.get_by_role("link", name="To the start").click()
    expect(page.get_by_role("button", name="Try the example")).to_be_visible()


def test_a_server_that_was_away_is_told_and_recovered_from(tabs, server):
    page = tabs.open(server.url)
    expect(page.get_by_role("button", name="Try the example")).to_be_visible()
    page.route("**/api/**", lambda route: route.abort())
    page.get_by_role("link", name="Library").click()
    expect(page.get_by_text("omocap does not answer. Is it still running?")).to_be_visible()
    expect(page.get_by_role("alert")).to_contain_text("omocap serve")
    page.unroute("**/api/**")
    expect(page.get_by_role("heading", level=1)).to_have_text("Library")
    expect(page.locator("#banner p")).to_have_count(0)


def test_keyboard_alone_reaches_a_running_job_and_stops_it(tabs, server, example):
    page = tabs.open(server.url)
    expect(page.get_by_role("button", name="Try the example")).to_be_visible()
    page.keyboard.press("Tab")
    assert _focused(page) == "Skip to the content"
    _tab_to(page, "Try the example")
    page.keyboard.press("Enter")
    expect(page.get_by_text("This recording is good")).to_be_visible(timeout=90_000)
    assert page.evaluate("document.activeElement.tagName") == "H1"
    _tab_to(page, "More options")
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    page.keyboard.type("1000")
    _tab_to(page, "Make the motion")
    page.keyboard.press("Enter")
    page.wait_for_url(re.compile("#/jobs/"))
    expect(page.get_by_role("button", name="Cancel")).to_be_visible()
    _tab_to(page, "Cancel")
    page.keyboard.press("Enter")
    expect(page.get_by_role("main").get_by_text("Cancelled")).to_be_visible(timeout=120_000)


def test_radio_buttons_keep_the_focus_when_another_object_is_chosen(tabs, server, example):
    page = tabs.open(server.at(f"/sessions/{example['session']}"))
    radio = page.get_by_role("radio", name=re.compile("Example: box"))
    radio.focus()
    page.keyboard.press("Space")
    page.wait_for_url("**object=**")
    expect(page.get_by_role("radio", name=re.compile("Example: box"))).to_be_focused()


def _focused(page) -> str:
    return page.evaluate("document.activeElement.textContent.trim()")


def _tab_to(page, words: str) -> None:
    for _ in range(120):
        page.keyboard.press("Tab")
        if _focused(page) == words:
            shown = page.evaluate(
                "(() => { const s = getComputedStyle(document.activeElement);"
                " return s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) > 0; })()"
            )
            assert shown, f"the focus on {words} is not seen"
            return
    raise AssertionError(f"{words} is not reached with Tab")
