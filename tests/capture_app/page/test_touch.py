"""Whatever is pressed is at least 24 pixels wide and high, for fingers (WCAG 2.5.8)."""

import pytest
from playwright.sync_api import expect

PAGES = {
    "start": "/",
    "library": "/library",
    "session": "/sessions/{session}?object={object}&mount={mount}",
    "shaken": "/sessions/{shaken}",
    "ways": "/calibrate?way=points&object={object}",
    "result": "/results/{motion}",
    "compare": "/compare?results={motion},{motion}",
}
SMALL = """() => {
    const told = [];
    const pressed = "a, button, select, summary, input, [role=slider]";
    for (const one of document.querySelectorAll(pressed)) {
        // A label is pressed as its field is; a contact is as wide as it is long.
        const target = one.closest("label") ?? one;
        const { width, height } = target.getBoundingClientRect();
        if (!one.checkVisibility({ visibilityProperty: true }) || width * height === 0) continue;
        if (getComputedStyle(one).position === "absolute" && one.matches(".skip")) continue;
        const inText = one.matches("a") && getComputedStyle(one).display === "inline"
            && one.parentElement.textContent.trim() !== one.textContent.trim();
        if (inText) continue;
        const wide = one.matches(".tl-bar") ? 24 : width;
        if (Math.min(wide, height) < 23.9)
            told.push(`${one.outerHTML.slice(0, 120)}: ${width.toFixed(1)} x ${height.toFixed(1)}`);
    }
    return told;
}"""


@pytest.mark.parametrize("name", PAGES)
def test_targets_are_large_enough(tabs, server, example, motion, shaken, name):
    page = tabs.open(server.at(PAGES[name].format(**example, motion=motion, shaken=shaken)))
    page.set_viewport_size({"width": 390, "height": 844})
    expect(page.locator("main h1")).to_be_visible()
    expect(page.locator("main[aria-busy], main [aria-busy]")).to_have_count(0, timeout=90_000)
    if name == "result":
        page.get_by_role("button", name="Correct the contacts").click()
    page.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
    assert page.evaluate(SMALL) == []
