"""Lists: what is good in them, found by name and by how good it is."""

import re

from playwright.sync_api import expect


def test_lists_tell_what_is_good(tabs, server, example, motion, shaken):
    for session in (example["session"], shaken):
        server.ask(f"sessions/{session}/report")
    page = tabs.open(server.at("/library"))
    row = page.locator("li", has=page.locator(f"a[href='#/sessions/{shaken}']"))
    expect(row.locator(".badge")).to_have_text(re.compile("usable with limits"))
    for kind, words in (("mount", "error unknown"), ("object", "good")):
        row = page.locator("li", has=page.locator(f"a[href='#/{kind}s/{example[kind]}']"))
        expect(row.locator(".badge")).to_have_text(re.compile(words))
    expect(page.locator(f"a[href='#/results/{motion}'] .badge")).to_be_visible()
    # What somebody tries out with a recording changes nothing of what lists say of it.
    server.ask(f"sessions/{shaken}/report?segment=99")
    page.reload()
    row = page.locator("li", has=page.locator(f"a[href='#/sessions/{shaken}']"))
    expect(row.locator(".badge")).to_have_text(re.compile("usable with limits"))


def test_the_library_is_searched_and_filtered(tabs, server, example, shaken):
    server.ask(f"sessions/{shaken}/report")
    page = tabs.open(server.at("/library"))
    page.get_by_label("Search by name").fill("shak")
    expect(page.get_by_text("1 thing found.")).to_be_visible()
    expect(page.locator("section .row-name")).to_have_text(["Shaken"])
    page.get_by_role("combobox", name="Show").select_option("ok")
    expect(page.get_by_text("0 things found.")).to_be_visible()
    page.get_by_label("Search by name").fill("Example: box")
    expect(page.locator("section .row-name").first).to_have_text("Example: box")
    page.locator("section .row-name").first.click()
    page.wait_for_url(re.compile("#/objects/"))
    page.go_back()
    expect(page.get_by_label("Search by name")).to_have_value("Example: box")
