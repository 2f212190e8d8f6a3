"""`omocap overlay`: the film with the person in it, or one clear paragraph and nothing written."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import typer

from capture_app.cli.overlay import overlay
from capture_app.manifest import MOTION
from capture_app.overlay.aligned import draw
from capture_app.overlay.aligned import watched as seen_by
from capture_app.overlay.overlay_film import on_tripod
from capture_app.overlay.placing import FilmPlacement
from capture_app.result import load_result
from ingest.calibration.board.board_lens import distorted
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from omomo_core.errors import InputError
from omomo_core.motion import FPS
from render.backends import open_renderer
from render.overlay import LensDistortion, OverlayStyle, draw_outline, pixels_of
from render.props import floor, play, retimed, rigid_object
from render.scene import Scene
from render.video import write_video
from tests.simulator.witness import object_poses
from tests.video_frames import read_frames

# Made in conftest.py.
Watched = Any
Result = Any
W, H = 320, 180
RATE, COUNT = 2.0, 4


@pytest.fixture(scope="module")
def filmed(watched: Watched, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some pictures of the box over a floor, and the camera's file beside them."""
    folder = tmp_path_factory.mktemp("film")
    witness = replace(watched.witness, camera=watched.witness.camera.at(W, H), rate=RATE)
    camera = witness.camera
    lens = LensDistortion(camera.K, W, H, lambda rays: distorted(rays, camera.lens))
    eye = lens.camera(witness.T_world_camera @ T_OPENCV_ARKIT_CAMERA)
    box = rigid_object(watched.motion)
    at = (witness.start + np.arange(COUNT) / RATE) * FPS
    with open_renderer(lens.width, lens.height) as renderer:
        ground = floor(np.array([-1.0, -1]), np.array([1.0, 1]))
        renderer.show(Scene([ground, box.drawable]))
        straight = list(
            play(renderer, [retimed(box, at, len(watched.motion.valid))], [eye] * COUNT)
        )
    write_video(folder / "witness.mp4", map(lens.bend, straight), RATE, crf=10)
    table = {"fx": camera.fx, "fy": camera.fy, "cx": camera.cx, "cy": camera.cy}
    table |= {"distortion": list(camera.distortion), "width": W, "height": H}
    table["T_world_camera"] = witness.T_world_camera.tolist()
    (folder / "camera.json").write_text(json.dumps(table))
    return folder


def run(result: Path, *words: str) -> None:
    """The command as `omocap overlay` runs it; what it refuses is raised."""
    app = typer.Typer(pretty_exceptions_enable=False)
    app.command()(overlay)
    app([str(result), *words], standalone_mode=False)


def drawn(filmed: Path, result: Result, watched: Watched, style: OverlayStyle, **how: Any):
    witness = watched.witness
    watcher = on_tripod(filmed / "witness.mp4", witness.camera.at(W, H))
    aligned = seen_by(result, watcher, FilmPlacement(witness.T_world_camera, witness.start))
    before = [picture for _, picture in aligned.film.read(0, len(aligned.seconds))]
    return aligned, before, [picture for _, picture in draw(result, 0, aligned, style, **how)]


@pytest.mark.parametrize("backend", ["pyrender", "raycast"])
def test_the_person_is_where_the_truth_is_and_behind_the_real_box(
    filmed: Path, result: Result, watched: Watched, backend: str
) -> None:
    aligned, before, after = drawn(
        filmed, result, watched, OverlayStyle("hidden"), backend=backend, samples=0
    )
    assert len(after) == len(before) >= 4
    box = masks(aligned, watched, 2)
    changed = (after[2] != before[2]).any(axis=-1)
    pixels = pixels_of(watched.human.joints[0, :22], aligned.cameras[2], aligned.distort)
    u, v = pixels[:, :2].round().astype(int).T
    inside = (u > 2) & (u < W - 3) & (v > 2) & (v < H - 3)
    u, v = u[inside], v[inside]
    open_air = ~grown(box)[v, u]
    assert open_air.sum() >= 3
    assert changed[v[open_air], u[open_air]].all()
    # The box is between camera and person: the film stays, but for shadows that fall on its top.
    inner = erode(box)
    darker = (after[2].astype(int) <= before[2].astype(int) + 1).all(axis=-1)
    assert inner.sum() > 150
    assert darker[inner].all()
    assert (changed & ~box).sum() > 250


def masks(aligned: Any, watched: Watched, picture: int) -> np.ndarray:
    """Where the truth has the box, filled."""
    T = object_poses(watched.motion, aligned.seconds[[picture]])[0]
    points = watched.motion.mesh.vertices @ T[:3, :3].T + T[:3, 3]
    canvas = np.zeros((H, W, 3), np.uint8)
    draw_outline(
        canvas,
        points,
        watched.motion.mesh.faces,
        aligned.cameras[picture],
        aligned.distort,
        (1.0, 1.0, 1.0),
    )
    flood = canvas[..., 0].copy()
    flood[flood > 0] = 255
    rims = cv2.findContours(flood, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    return cv2.drawContours(np.zeros((H, W), np.uint8), rims, -1, 1, cv2.FILLED) > 0


def grown(mask: np.ndarray) -> np.ndarray:
    return cv2.dilate(mask.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0


def erode(mask: np.ndarray) -> np.ndarray:
    return cv2.erode(mask.astype(np.uint8), np.ones((7, 7), np.uint8)) > 0


def test_nothing_drawn_is_the_film_itself(filmed: Path, result: Result, watched: Watched) -> None:
    _, before, after = drawn(filmed, result, watched, OverlayStyle("hidden", opacity=0.0))
    assert all((a == b).all() for a, b in zip(before, after, strict=True))


def test_a_drawn_box_covers_the_real_one_and_an_outline_runs_round_it(
    filmed: Path, result: Result, watched: Watched
) -> None:
    aligned, _, solid = drawn(filmed, result, watched, OverlayStyle("drawn"))
    _, _, outline = drawn(filmed, result, watched, OverlayStyle("outline"))
    _, _, hidden = drawn(filmed, result, watched, OverlayStyle("hidden"))
    box = masks(aligned, watched, 2)
    inner = erode(box)
    orange = solid[2][inner].astype(int)
    assert (orange[:, 0] - orange[:, 2] > 25).mean() > 0.9
    line = (outline[2] != hidden[2]).any(axis=-1)
    assert line.sum() > 40
    assert not line[inner].any()


def test_the_wipe_shows_the_film_on_its_left(
    filmed: Path, result: Result, watched: Watched
) -> None:
    _, before, after = drawn(filmed, result, watched, OverlayStyle("drawn", wipe=True))
    assert (after[0][:, : W // 11] == before[0][:, : W // 11]).all()
    white = [(picture == 255).all(axis=(0, 2)).argmax() for picture in after]
    assert len(set(white)) == len(white)


@pytest.mark.runs("overlay")
def test_the_command_writes_a_video_of_the_overlap(
    filmed: Path, result: Result, tmp_path: Path
) -> None:
    out = tmp_path / "over.mp4"
    words = ["--video", str(filmed / "witness.mp4"), "--camera", str(filmed / "camera.json")]
    run(result.folder, *words, "--offset", "0.97", "-o", str(out))
    assert read_frames(out, [3])[0].shape == (H, W, 3)
    # A film that began before the motion loses what is before it.
    run(result.folder, *words, "--offset", "-0.9", "-o", str(out))
    with pytest.raises(IndexError):
        read_frames(out, [3])


def test_the_phones_own_film_shows_the_person(
    phone_result: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "own.gif"
    run(phone_result.folder, "-o", str(out), "--object", "drawn")
    first = read_frames(out, [0])[0].astype(int)
    assert first.shape == (60, 80, 3)
    blue = (first[..., 2] - first[..., 0] > 20).mean()
    assert blue > 0.02  # the person, whom the phone looks at
    assert "hardly in it" not in capsys.readouterr().out


def test_a_film_without_the_person_is_told_before_it_is_drawn(
    filmed: Path, result: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = json.loads((filmed / "camera.json").read_text())
    T = np.array(table["T_world_camera"])
    T[:3, :3] = T[:3, :3] @ np.diag([-1.0, 1.0, -1.0])  # it looks the other way
    camera, out = tmp_path / "turned.json", tmp_path / "over.mp4"
    camera.write_text(json.dumps(table | {"T_world_camera": T.tolist()}))
    words = ["--video", str(filmed / "witness.mp4"), "--camera", str(camera), "--offset", "0.97"]
    run(result.folder, *words, "-o", str(out))
    told = capsys.readouterr().out
    assert re.search(r"Note: The person is in 0 of the film's \d pictures: the camera", told)
    assert (
        told.index("Note: The person") < told.index("Done:") < told.index("but look at: the film")
    )


def text_for_a_video(filmed: Path) -> list[str]:
    (filmed / "text.mp4").write_text("not a film")
    return ["--video", str(filmed / "text.mp4"), "--camera", str(filmed / "camera.json")]


def torn_video(filmed: Path) -> list[str]:
    data = (filmed / "witness.mp4").read_bytes()
    torn = bytearray(data)
    start = data.find(b"mdat") + 200
    torn[start : start + (len(data) - start) // 2] = bytes((len(data) - start) // 2)
    (filmed / "torn.mp4").write_bytes(bytes(torn))
    camera = str(filmed / "camera.json")
    return ["--video", str(filmed / "torn.mp4"), "--camera", camera, "--offset", "1"]


def no_camera(filmed: Path) -> list[str]:
    return ["--video", str(filmed / "witness.mp4"), "--offset", "1"]


def camera_without_focal(filmed: Path) -> list[str]:
    (filmed / "bare.json").write_text('{"width": 320, "height": 180}')
    return ["--video", str(filmed / "witness.mp4"), "--camera", str(filmed / "bare.json")]


def camera_without_place(filmed: Path) -> list[str]:
    (filmed / "nowhere.json").write_text('{"fx": 300, "fy": 300, "cx": 160, "cy": 90}')
    return ["--video", str(filmed / "witness.mp4"), "--camera", str(filmed / "nowhere.json")]


def mirrored_place(filmed: Path) -> list[str]:
    table = json.loads((filmed / "camera.json").read_text())
    table["T_world_camera"] = np.diag([1.0, 1, -1, 1]).tolist()
    (filmed / "mirrored.json").write_text(json.dumps(table))
    return ["--video", str(filmed / "witness.mp4"), "--camera", str(filmed / "mirrored.json")]


def no_offset(filmed: Path) -> list[str]:
    return ["--video", str(filmed / "witness.mp4"), "--camera", str(filmed / "camera.json")]


def another_time(filmed: Path) -> list[str]:
    return [*no_offset(filmed), "--offset", "-99"]


def no_phone(filmed: Path) -> list[str]:
    return []


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (text_for_a_video, "no-video"),
        (torn_video, "pictures-damaged"),
        (no_camera, "camera-needed"),
        (camera_without_focal, "camera-unreadable"),
        (camera_without_place, "camera-place-needed"),
        (mirrored_place, "camera-pose"),
        (no_offset, "offset-needed"),
        (another_time, "overlay-no-overlap"),
        (no_phone, "overlay-no-phone"),
    ],
)
def test_what_cannot_be_drawn_is_refused_and_leaves_nothing(
    filmed: Path,
    result: Result,
    tmp_path: Path,
    words: Callable[[Path], list[str]],
    code: str,
) -> None:
    with pytest.raises(InputError) as refused:
        run(result.folder, *words(filmed), "-o", str(tmp_path / "over.mp4"))
    assert refused.value.code == code
    assert refused.value.fix
    assert not list(tmp_path.iterdir())


def test_the_output_must_be_a_file_that_can_be_written(
    filmed: Path, result: Result, tmp_path: Path
) -> None:
    good = [*no_offset(filmed), "--offset", "0.97", "-o"]
    (tmp_path / "folder.mp4").mkdir()
    # All that is written to this name finds a full disk.
    (tmp_path / ".partial.full.mp4").symlink_to("/dev/full")
    for name, code in (
        ("folder.mp4", "output-is-folder"),
        ("over.txt", "output-ending"),
        ("none/over.mp4", "output-not-writable"),
        ("full.mp4", "disk-full"),
    ):
        with pytest.raises(InputError) as refused:
            run(result.folder, *good, str(tmp_path / name))
        assert refused.value.code == code
    assert [path.name for path in tmp_path.iterdir()] == ["folder.mp4"]


def test_an_object_of_points_alone_is_refused(filmed: Path, result: Result, tmp_path: Path) -> None:
    bare = tmp_path / "bare"
    shutil.copytree(result.folder, bare)
    with np.load(bare / MOTION) as file:
        arrays = dict(file)
    arrays["object_faces"] = np.empty((0, 3), np.int32)
    np.savez(bare / MOTION, **arrays)
    assert len(load_result(bare).object_motion.mesh.faces) == 0
    with pytest.raises(InputError) as refused:
        run(bare, *no_offset(filmed), "--offset", "0.97", "-o", str(tmp_path / "over.mp4"))
    assert refused.value.code == "object-no-faces"
    assert not (tmp_path / "over.mp4").exists()
