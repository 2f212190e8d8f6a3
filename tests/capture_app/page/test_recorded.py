"""Recordings become a mount, and a film an object, by what the page says alone."""

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from playwright.sync_api import expect
from scipy.spatial.transform import Rotation

from capture_app.simulator.demo_take import box_mesh, clamped_phone, write_recording
from capture_app.simulator.simulated_phone import simulate
from ingest.calibration.board.board_spec import PRESETS
from omomo_core.motion import FPS
from tests.capture_app.page.choosing import choose
from tests.ingest.calibration.board.filmed import picture, write_film
from tests.simulator.wiggle import wiggle_motion
from tests.simulator.witness import board_on_box, tripod

BOARD = PRESETS["A4"]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the log of a phone on a box, a tracker's log, and the film of a board on it."""
    folder = tmp_path_factory.mktemp("recorded")
    motion = wiggle_motion("all axes", seconds=12.0, seed=3)
    write_recording(simulate(motion, clamped_phone(), seed=1), folder / "take")
    T = motion.T_world_object
    turns = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    rows = np.column_stack([np.arange(len(T)) / FPS, T[:, :3, 3], turns])
    np.savetxt(folder / "poses.csv", rows, delimiter=",", header="t,x,y,z,qx,qy,qz,qw")
    witness = tripod(distance=0.8, size=(640, 480), rate=4.0)
    poses = witness.board_poses(motion, board_on_box(BOARD))
    stamps = [round(1000 * time) for time in witness.times(motion)]
    frames = [picture(pose, BOARD, witness.camera) for pose in poses]
    write_film(folder / "film.mp4", frames, stamps)
    return folder


@pytest.fixture(scope="module")
def box(server, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Id of the box that the phone is on."""
    mesh, folder = box_mesh(), tmp_path_factory.mktemp("box")
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(folder / "box.obj")
    return server.bring("object", "The box", folder)


def corners(page) -> None:
    """Type where the corners of the board are on the box."""
    side, down = BOARD.width, BOARD.height
    at = np.array([[0, 0], [side, 0], [side, down], [0, down]])
    flat = np.column_stack([at, np.zeros(4), np.ones(4)])
    places = 100 * (flat @ board_on_box(BOARD).T)[:, :3]
    page.get_by_text("Type the place instead of clicking").click()
    for place in places:
        for axis, value in zip("xyz", place, strict=True):
            page.get_by_label(f"{axis} (cm)").fill(f"{value:.3f}")
        page.get_by_role("button", name="Add this point").click()


def test_a_tracker_step_by_step(tabs, server, box, recorded):
    page = tabs.open(server.at(f"/calibrate?way=tracker&object={box}"))
    find = page.get_by_role("button", name="Find the mount")
    find.click()
    expect(page.get_by_role("alert")).to_contain_text("Still missing: the recording")
    choose(page, "Drop the recording here", recorded / "take")
    expect(page.get_by_text("tracked without a break")).to_be_visible(timeout=120_000)
    choose(page, "Drop the tracker's log here", recorded / "take" / "imu.csv")
    expect(page.get_by_role("alert")).to_contain_text("What to do:", timeout=120_000)
    choose(page, "Drop the tracker's log here", recorded / "poses.csv")
    expect(page.get_by_text("poses, 30 a second, 12 s")).to_be_visible(timeout=120_000)
    page.get_by_role("textbox", name="Name of the mount").fill("By the tracker")
    find.click()
    page.wait_for_url(re.compile(r"#/mounts/"), timeout=90_000)
    expect(page.get_by_role("heading", level=1)).to_have_text("By the tracker")
    expect(page.get_by_text(re.compile(r"± \d+\.\d mm"))).to_be_visible()
    expect(page.locator(".stage-message p")).to_have_count(0, timeout=120_000)
    mount = server.ask(f"mounts/{page.url[-16:]}")
    assert (mount["method"], mount["object"], mount["free"]) == ("tracker", box, [])


@pytest.mark.slow
def test_a_board_and_a_second_camera(tabs, server, box, recorded):
    page = tabs.open(server.at(f"/calibrate?way=board&object={box}"))
    with page.expect_download() as sheet:
        page.get_by_role("link", name="Get the sheet to print").click()
    assert sheet.value.path().read_bytes().startswith(b"%PDF")
    corners(page)
    expect(page.locator(".pairs li")).to_have_count(4)
    choose(page, "Drop the recording here", recorded / "take")
    choose(page, "Drop the second camera's film here", recorded / "film.mp4")
    expect(page.get_by_text("show the board")).to_be_visible(timeout=120_000)
    page.get_by_role("button", name="Find the mount").click()
    page.wait_for_url(re.compile(r"#/mounts/"), timeout=120_000)
    mount = server.ask(f"mounts/{page.url[-16:]}")
    assert mount["method"] == "board"
    assert mount["bounds"]["mm"] < 15


def test_a_recording_that_does_not_do_says_so_and_leads_back(tabs, server, box, recorded, example):
    page = tabs.open(server.at(f"/calibrate?way=floor&object={box}"))
    page.get_by_label("The recording").select_option(example["session"])
    page.get_by_label("The mount to be made surer").select_option(example["mount"])
    page.get_by_label("From the floor up to the lens").fill("4.9")
    page.get_by_role("button", name="Find the mount").click()
    expect(page.get_by_role("alert")).to_contain_text("What to do:", timeout=90_000)
    page.get_by_role("link", name="Back, to change something").click()
    page.wait_for_url(re.compile(r"#/calibrate\?way=floor"))


@pytest.mark.slow
def test_a_film_becomes_an_object_and_can_be_cancelled(tabs, server, tmp_path):
    from tests.capture_app.scanning.filmed import film_small

    film = film_small(tmp_path / "film").path
    page = tabs.open(server.at("/scan"))
    choose(page, "Drop the recording here", film)
    name = page.get_by_role("textbox", name="Name of the object")
    expect(name).to_have_value("film", timeout=120_000)
    page.get_by_text("More options").click()
    page.get_by_label("Corners of the mesh").fill("1000")
    page.get_by_label("Measure the surface by").select_option("depth")
    page.get_by_role("button", name="Make the object").click()
    page.wait_for_url(re.compile(r"#/jobs/"))
    cancel = page.get_by_role("button", name="Cancel")
    cancel.click()
    expect(page.locator(".verdict-words")).to_have_text("Cancelled", timeout=120_000)
    assert list((server.library / "objects").glob(".*.part")) == []
    page.get_by_role("button", name="Begin again").click()
    page.wait_for_url(re.compile(r"#/objects/"), timeout=280_000)
    expect(page.get_by_role("heading", name="The scan")).to_be_visible()
    for alt in ("The mesh from four sides", "Its outline"):
        shown = page.get_by_alt_text(re.compile(alt))
        shown.scroll_into_view_if_needed()
        page.wait_for_function("(one) => one.naturalWidth > 0", arg=shown.element_handle())
    made = server.ask(f"objects/{page.url[-16:]}")
    assert made["scan"]["severity"] in ("ok", "warn")
    assert 0.2 < max(made["extents"]) < 0.8


def test_a_video_from_elsewhere_is_drawn_and_shown(tabs, server, motion):
    page = tabs.open(server.at(f"/results/{motion}"))
    page.get_by_text("Seen from elsewhere").click()
    page.get_by_label("Seen").select_option("top")
    page.get_by_role("button", name="Draw the video").click()
    page.wait_for_url(re.compile(r"#/jobs/"))
    page.get_by_role("button", name="Cancel").click()
    expect(page.locator(".verdict-words")).to_have_text("Cancelled", timeout=120_000)
    page.get_by_role("link", name="Back to the motion").click()
    page.wait_for_url(re.compile(r"#/results/"))


@pytest.mark.slow
def test_the_person_in_the_phones_film(tabs, server, motion):
    page = tabs.open(server.at(f"/results/{motion}"))
    page.get_by_text("The person in a film of the take").click()
    # The phone films this person at no time, so it must be chosen.
    page.get_by_role("combobox", name="Into").select_option("own")
    page.get_by_role("button", name="Draw into the film").click()
    page.wait_for_url(re.compile(r"#/jobs/"))
    film = page.locator("video.film")
    expect(film).to_be_visible(timeout=280_000)
    page.wait_for_function("(one) => one.videoWidth > 0", arg=film.element_handle())


def test_lists_show_pictures(tabs, server, motion, box):
    page = tabs.open(server.at("/library"))
    for address in (f"results/{motion}/picture", f"objects/{box}/picture"):
        shown = page.locator(f'img[data-of="{address}"]')
        shown.scroll_into_view_if_needed()
        page.wait_for_function(
            "(one) => one.naturalWidth > 0", arg=shown.element_handle(), timeout=90_000
        )
