"""Single pictures with poses are a film, of the clamped phone and of a second one."""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import pytest

from capture_app.commands.overlay import OverlayRequest
from capture_app.overlay.find_camera import find, overlay_result
from capture_app.replay.session_track import film_strip
from capture_app.result import Result
from capture_app.simulator.simulated_phone import PhoneNoise, simulate
from ingest.formats import arkit_recorder, nerfcapture, nerfstudio, polycam, record3d, scanner_3d
from ingest.formats.registry import read_session
from ingest.mount_file import save_mount
from ingest.report.take_inspection import inspect_session
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from tests.capture_app.overlay.taken import PHONE, Watched, standing, write_result
from tests.log_writers import write_session
from tests.video_frames import read_frames

EVERY, FRAMES = 12, 62
"""Poses from one picture to the next, at 60 a second; frames of the motion."""


@dataclass(frozen=True)
class Taken:
    """What the phone logged, its pictures grey, and the motion that it was."""

    session: CaptureSession
    watched: Watched

    def result(self, folder: Path, source: Path) -> Result:
        save_mount(PHONE, folder / "mount.json")
        inputs = {"session": source, "mount": folder / "mount.json"}
        return write_result(folder / "result", self.watched, animated=False, **inputs)


@pytest.fixture(scope="module")
def taken(watched: Watched, tmp_path_factory: pytest.TempPathFactory) -> Taken:
    folder = tmp_path_factory.mktemp("pictures")
    T, valid = watched.motion.T_world_object[:FRAMES], watched.motion.valid[:FRAMES]
    motion = replace(watched.motion, T_world_object=T, valid=valid)
    session = simulate(motion, PHONE, seed=0, noise=PhoneNoise(drift=0.0))
    at = np.arange(0, len(session.times), EVERY)
    files = tuple(folder / f"{k:05d}.jpg" for k in at)
    for file in files:
        cv2.imwrite(str(file), np.full((90, 120, 3), 128, np.uint8))
    pictured = replace(session, video=None, images=files, video_times=session.times[at])
    return Taken(pictured, replace(watched, motion=motion, human=standing(FRAMES, -0.5)))


def _of(**said: Any) -> OverlayRequest:
    return OverlayRequest(result=Path("result"), output=Path("film.mp4"), **said)


@pytest.mark.parametrize(
    "app", [arkit_recorder, nerfcapture, nerfstudio, polycam, record3d, scanner_3d]
)
def test_they_are_the_film_of_the_clamped_phone(taken: Taken, tmp_path: Path, app: ModuleType):
    source = write_session(app, taken.session, tmp_path / "take")
    aligned = find(taken.result(tmp_path, source), _of(), lambda stage, done: None)
    expected = taken.session.video_times
    assert expected is not None
    np.testing.assert_allclose(aligned.seconds, expected - expected[0], atol=0.02)
    assert aligned.fps == pytest.approx(60 / EVERY, rel=0.02)
    pictures = [picture for _, picture in aligned.film.read(0, 3)]
    assert [picture.shape for picture in pictures] == [(90, 120, 3)] * 3
    assert all(abs(int(picture.mean()) - 128) < 3 for picture in pictures)


def test_the_person_is_drawn_into_them(taken: Taken, tmp_path: Path):
    source = write_session(polycam, taken.session, tmp_path / "take")
    result = taken.result(tmp_path, source)
    film = tmp_path / "film.mp4"
    overlay_result(OverlayRequest(result=result.folder, output=film), lambda stage, done: None)
    times = taken.session.video_times
    assert times is not None
    drawn = read_frames(film, range(len(times)))
    with pytest.raises(IndexError):
        read_frames(film, [len(times)])
    assert any(np.abs(picture.astype(int) - 128).max() > 40 for picture in drawn)


def _cut(source: Path, wanted: slice) -> list[str]:
    """Cut pictures short; returns their names."""
    files = sorted((source / "keyframes" / "images").glob("*.jpg"))[wanted]
    for file in files:
        file.write_bytes(file.read_bytes()[:-40])
    return [file.name for file in files]


def test_one_damaged_picture_of_many_is_left_out_and_named(taken: Taken, tmp_path: Path):
    source = write_session(polycam, taken.session, tmp_path / "take")
    [name] = _cut(source, slice(4, 5))
    result, film = taken.result(tmp_path, source), tmp_path / "film.mp4"
    request = OverlayRequest(result=result.folder, output=film)
    made = overlay_result(request, lambda stage, done: None)
    assert taken.session.images is not None
    count = len(taken.session.images)
    said = f"1 of {count} pictures cannot be read and is left out: {name}."
    assert said in made.notes
    assert len(list(read_frames(film, range(count - 1)))) == count - 1
    with pytest.raises(IndexError):
        read_frames(film, [count - 1])
    report = inspect_session(read_session(source))
    assert next(check.message for check in report.checks if check.name == "video") + "." == said


def test_a_replay_passes_over_a_damaged_picture(taken: Taken, tmp_path: Path):
    source = write_session(polycam, taken.session, tmp_path / "take")
    times = taken.session.times
    strips = [film_strip(read_session(source), times[0], times[-1], 0)]
    _cut(source, slice(1, 2))
    strips.append(film_strip(read_session(source), times[0], times[-1], 0))
    whole, damaged = strips
    assert whole is not None
    assert damaged is not None
    assert len(whole.times) >= 4
    np.testing.assert_array_equal(damaged.times, np.delete(whole.times, 1))


@pytest.mark.parametrize("wanted", [slice(0, 4), slice(None)])
def test_many_damaged_pictures_are_refused(taken: Taken, tmp_path: Path, wanted: slice):
    source = write_session(polycam, taken.session, tmp_path / "take")
    names = _cut(source, wanted)
    assert taken.session.images is not None
    said = f"{len(names)} of {len(taken.session.images)} pictures cannot be read: {names[0]}"
    with pytest.raises(InputError, match=said) as caught:
        find(taken.result(tmp_path, source), _of(), lambda stage, done: None)
    assert caught.value.code == "pictures-damaged"
    report = inspect_session(read_session(source))
    video = next(check for check in report.checks if check.name == "video")
    assert video.severity == "warn"
    assert video.message.startswith(said)


@pytest.mark.parametrize("given", ["folder", "archive", "file of poses"])
def test_a_second_phones_are_found_however_they_are_given(taken: Taken, tmp_path: Path, given: str):
    source = write_session(nerfstudio, taken.session, tmp_path / "take")
    paths = {"folder": source, "file of poses": tmp_path / "take" / "transforms.json"}
    if given == "archive":
        paths[given] = Path(shutil.make_archive(str(tmp_path / "take"), "zip", source))
    result = taken.result(tmp_path, source)
    said = _of(video=paths[given], shared_world=True, offset=-float(taken.session.times[0]))
    aligned = find(result, said, lambda stage, done: None)
    times = taken.session.video_times
    assert times is not None
    assert len(aligned.seconds) == len(times)


def test_a_video_and_what_is_neither_are_no_sessions(taken: Taken, tmp_path: Path):
    result = taken.result(tmp_path, write_session(nerfstudio, taken.session, tmp_path / "take"))
    other = tmp_path / "notes.mp4"
    other.write_bytes(bytes(range(256)) * 20)
    for path in (other, tmp_path / "nowhere.mp4"):
        with pytest.raises(InputError) as caught:
            find(result, _of(video=path), lambda stage, done: None)
        assert caught.value.code == "camera-needed"
