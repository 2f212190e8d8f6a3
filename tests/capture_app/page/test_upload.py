"""Recordings and meshes that are brought: dropped, cut off, gone on with, cancelled."""

import json
import re
import shutil
from pathlib import Path

import pytest
from playwright.sync_api import expect

DEMO = Path(__file__).resolve().parents[3] / "capture_app" / "demo_take"
PARTS = re.compile(r"/api/uploads/[0-9a-f]{16}/files/")
FOLDER, FILES = "input[webkitdirectory]", "input[type=file]:not([webkitdirectory])"


@pytest.fixture
def take(tmp_path: Path) -> Path:
    """The example's recording in a folder of a name of its own."""
    return Path(shutil.copytree(DEMO / "session", tmp_path / "kitchen chair"))


def _reported(page) -> str:
    page.wait_for_url(re.compile(r"#/sessions/[0-9a-f]{16}"))
    expect(page.locator(".verdict-words")).to_contain_text("This recording is", timeout=90_000)
    return re.search(r"sessions/([0-9a-f]{16})", page.url)[1]


def test_folder_gives_report(tabs, server, take):
    page = tabs.open(server.url)
    page.locator(FOLDER).first.set_input_files(take)
    session = server.ask(f"sessions/{_reported(page)}")
    assert (session["name"], session["files"]) == ("kitchen chair", 4)


def test_what_is_no_recording_is_refused_and_not_lost(tabs, server, tmp_path):
    rubbish = tmp_path / "holiday.jpg"
    rubbish.write_bytes(b"\xff\xd8")
    before = len(server.ask("sessions"))
    page = tabs.open(server.url)
    page.locator(FILES).first.set_input_files(rubbish)
    expect(page.get_by_role("alert")).to_contain_text("This is not a phone session")
    assert len(server.ask("sessions")) == before
    page.reload()
    expect(page.get_by_text("Unfinished: holiday.jpg")).to_be_visible()
    page.get_by_role("button", name="Throw it away").click()
    expect(page.get_by_text("Unfinished: holiday.jpg")).to_have_count(0)


def test_from_a_drop_to_the_motion_it_is_one_click(tabs, server, tmp_path):
    folder = tmp_path / "all of it"
    page = tabs.open(server.url)
    page.locator(".drop").first.wait_for()
    folder.mkdir()
    for name in ("session/odometry.csv", "session/camera_matrix.csv", "box.obj", "mount.json"):
        shutil.copy(DEMO / name, folder / Path(name).name)
    page.locator(FILES).first.set_input_files(sorted(folder.iterdir()))
    _reported(page)
    make = page.get_by_role("button", name="Make the motion")
    expect(make).to_be_enabled(timeout=90_000)
    page.get_by_label("Samples", exact=True).fill("1")
    page.get_by_text("More options").click()
    page.get_by_label("Steps of the sampler").fill("2")
    page.get_by_label("Draw a video").uncheck()
    make.click()
    page.wait_for_url(re.compile(r"#/results/"), timeout=90_000)
    expect(page.get_by_role("slider", name="Time")).to_be_visible(timeout=90_000)
    expect(page.locator("video")).to_have_count(0)


def test_dropped_files_are_sorted_by_what_they_are(tabs, server):
    page = tabs.open(server.url)
    names = ["session/odometry.csv", "session/camera_matrix.csv", "box.obj", "mount.json"]
    texts = {Path(name).name: (DEMO / name).read_text() for name in names}
    page.locator(".drop").first.wait_for()
    page.evaluate(
        """(texts) => {
            const given = new DataTransfer();
            for (const [name, text] of Object.entries(texts)) given.items.add(new File([text], name));
            const at = {dataTransfer: given, bubbles: true, cancelable: true};
            document.querySelector(".drop").dispatchEvent(new DragEvent("drop", at));
        }""",
        texts,
    )
    _reported(page)
    page.wait_for_url(re.compile(r"object=[0-9a-f]{16}&mount=[0-9a-f]{16}"))
    assert page.get_by_role("radio", checked=True).count() == 2


def test_a_folder_with_everything_in_it_is_understood_whole(tabs, server, tmp_path):
    """What `omocap simulate` writes: the session's folder, the mesh and the mount in one folder."""
    folder = tmp_path / "simulated"
    for name in ("session/odometry.csv", "session/camera_matrix.csv", "box.obj", "mount.json"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(DEMO / name, folder / name)
    page = tabs.open(server.url)
    page.locator(FOLDER).first.set_input_files(folder)
    _reported(page)
    page.wait_for_url(re.compile(r"object=[0-9a-f]{16}&mount=[0-9a-f]{16}"))
    assert server.ask(f"sessions/{_reported(page)}")["files"] == 2


def test_the_example_is_never_chosen_for_another_recording(tabs, server, example, take):
    before = {item["id"] for item in server.ask("objects")}
    assert example["object"] in before
    page = tabs.open(server.url)
    page.locator(FOLDER).first.set_input_files(take)
    _reported(page)
    expect(page.get_by_role("radio", name=re.compile("Example")).first).not_to_be_checked()
    assert example["object"] not in page.url
    assert example["mount"] not in page.url


def test_photos_and_films_go_to_where_an_object_is_made(tabs, server, tmp_path):
    photos = [tmp_path / f"{k}.jpg" for k in range(2)]
    for photo in photos:
        photo.write_bytes(b"\xff\xd8")
    page = tabs.open(server.url)
    page.locator(FILES).first.set_input_files(photos)
    page.wait_for_url(re.compile(r"#/scan\?source=[0-9a-f]{16}"))
    expect(page.get_by_text("Photos are no recording")).to_be_visible()
    expect(page.get_by_label("Filmed with")).to_have_value("material")


def test_what_is_dropped_on_the_wrong_form_is_taken_as_what_it_is(tabs, server, example):
    page = tabs.open(server.at(f"/sessions/{example['session']}"))
    page.locator(".drop", has_text="Drop a mesh of the object").locator(FILES).set_input_files(
        DEMO / "mount.json"
    )
    page.wait_for_url(re.compile(r"mount=[0-9a-f]{16}"))
    expect(page.get_by_text("This is a mount, so it was taken as one.")).to_be_visible()


def test_reload_in_the_middle_goes_on_where_it_was(tabs, server, take):
    page = tabs.open(server.url)
    sent: list[str] = []
    held: list[object] = []

    def hold(route):
        sent.append(route.request.url)
        if len(sent) <= 2:
            route.continue_()
        else:
            held.append(route)

    page.route(PARTS, hold)
    page.locator(FOLDER).first.set_input_files(take)
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    page.wait_for_function("() => document.querySelector('progress').value > 0")
    page.reload()
    expect(page.get_by_text("Unfinished: kitchen chair")).to_be_visible()
    (before,) = [one for one in server.ask("uploads") if one["name"] == "kitchen chair"]
    assert 0 < before["received"] < before["size"]
    files = server.ask(f"uploads/{before['id']}")["files"]
    there = [one["index"] for one in files if one["received"] == one["size"]]
    page.unroute(PARTS)
    later: list[str] = []
    page.on("request", lambda asked: later.append(asked.url) if PARTS.search(asked.url) else None)
    page.locator(FOLDER).first.set_input_files(take)
    assert _reported(page) == before["id"]
    assert later
    assert not [url for url in later for index in there if f"/files/{index}?" in url]


def test_lost_line_is_waited_for(tabs, server, take):
    page = tabs.open(server.url)
    cut = iter([True] * 8)
    page.route(PARTS, lambda route: route.abort() if next(cut, False) else route.continue_())
    page.locator(FOLDER).first.set_input_files(take)
    expect(
        page.get_by_role("main").get_by_text("The line is lost. It goes on by itself")
    ).to_be_visible()
    _reported(page)


def test_pause_and_cancel(tabs, server, take):
    page = tabs.open(server.url)
    page.route(PARTS, lambda route: None)
    page.locator(FOLDER).first.set_input_files(take)
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_role("main").get_by_text("paused")).to_be_visible()
    with page.expect_response(lambda answer: answer.request.method == "DELETE"):
        page.get_by_role("button", name="Cancel").click()
    expect(page.locator(".upload")).to_have_count(0)
    assert "kitchen chair" not in json.dumps(server.ask("uploads"))


def test_full_disk_is_told_in_words(tabs, server, take):
    page = tabs.open(server.url)
    full = {"code": "disk-full", "what": "The disk is full.", "where": "", "fix": "Make room."}
    page.route(PARTS, lambda route: route.fulfill(status=507, json={"error": full}))
    page.locator(FOLDER).first.set_input_files(take)
    expect(page.get_by_role("alert")).to_contain_text("Make room.")
    page.unroute(PARTS)
    page.get_by_role("button", name="Try again").click()
    _reported(page)


def test_mesh_in_centimetres_is_set_right_by_a_click(tabs, server, tmp_path):
    big = tmp_path / "crate.obj"
    lines = (DEMO / "box.obj").read_text().splitlines()
    big.write_text("\n".join(_times_hundred(line) for line in lines))
    page = tabs.open(server.url)
    page.locator(FILES).first.set_input_files(big)
    page.get_by_role("button", name="It is in centimetres").click()
    page.wait_for_url(re.compile(r"#/objects/[0-9a-f]{16}"))
    expect(page.get_by_text(re.compile(r"\d+ × \d+ × \d+ cm"))).to_be_visible()
    sides = server.ask(f"objects/{page.url[-16:]}")["extents"]
    assert 0.1 < max(sides) < 1.0


def _times_hundred(line: str) -> str:
    if not line.startswith("v "):
        return line
    return " ".join(["v", *(str(100 * float(word)) for word in line.split()[1:4])])
