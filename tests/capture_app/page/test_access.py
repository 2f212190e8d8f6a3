"""No serious finding of axe on any page, wide or narrow, light or dark."""

import pytest
from playwright.sync_api import expect

axe = pytest.importorskip("axe_playwright_python.sync_playwright")

PAGES = {
    "start": "/",
    "library": "/library",
    "session": "/sessions/{session}?object={object}&mount={mount}",
    "object": "/objects/{object}",
    "mount": "/mounts/{mount}",
    "ways": "/calibrate",
    "board": "/calibrate?way=board&object={object}",
    "tracker": "/calibrate?way=tracker",
    "scan": "/scan",
    "points": "/calibrate?way=points&object={object}",
    "drawing": "/calibrate?way=drawing&object={object}",
    "job": "/jobs/{motion}",
    "result": "/results/{motion}",
    "compare": "/compare?results={motion},{motion}",
    "gone": "/results/0123456789abcdef",
}
OFTEN = ("start", "session", "board", "scan", "job", "result")


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in OFTEN else pytest.mark.slow) for name in PAGES],
)
def test_no_serious_finding(tabs, server, example, motion, name):
    page = tabs.open(server.at(PAGES[name].format(**example, motion=motion)))
    expect(page.locator("main h1")).to_be_visible()
    expect(page.locator("main[aria-busy], main [aria-busy]")).to_have_count(0, timeout=90_000)
    page.evaluate("document.querySelectorAll('details').forEach((one) => (one.open = true))")
    for size in ({"width": 1280, "height": 800}, {"width": 390, "height": 844}):
        page.set_viewport_size(size)
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            assert _serious(page) == [], (size, scheme)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def _serious(page) -> list[str]:
    found = axe.Axe().run(page).response["violations"]
    return [
        f"{one['id']}: {one['help']}: {node['html'][:200]}"
        for one in found
        if one["impact"] in ("serious", "critical")
        for node in one["nodes"]
    ]
