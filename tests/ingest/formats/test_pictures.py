"""Videos, images and depth maps travel with a session; a damaged depth map is named."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from ingest.formats import (
    arkitscenes,
    ios_logger,
    iphumi,
    nerfcapture,
    nerfstudio,
    record3d,
    scan_capture,
    scanner_3d,
    scannetpp,
    spectacular,
    stray_scanner,
)
from ingest.formats.registry import Format, read_session
from ingest.session import CaptureSession, DepthLog
from tests.ingest.formats.logs import (
    LANDSCAPE,
    PICTURES,
    MakeTake,
    each,
    edit_json,
    error_of,
    picture,
    with_pictures,
)
from tests.log_writers import write_session


@each(stray_scanner, ios_logger, scan_capture, iphumi, scannetpp, spectacular)
def test_the_video_travels_with_its_times(take: MakeTake, tmp_path: Path, format_: Format):
    (tmp_path / "clip").write_bytes(b"pictures")
    session = replace(take(3), video=tmp_path / "clip")
    back = read_session(write_session(format_, session, tmp_path / "take"))
    assert back.video is not None
    assert back.video.read_bytes() == b"pictures"
    tolerance = 0.000501 if format_ is iphumi else 1e-6
    np.testing.assert_allclose(back.video_times, session.times, rtol=0, atol=tolerance)


@each(*PICTURES)
def test_images_and_depth_come_back(take: MakeTake, tmp_path: Path, format_: Format):
    session = with_pictures(take(3), tmp_path / "pictures")
    back = format_.read(write_session(format_, session, tmp_path / "take"))
    assert back.image_size == LANDSCAPE
    np.testing.assert_allclose(back.video_times, session.video_times, rtol=0, atol=6e-7)
    for image in back.images:
        seen = np.rot90(cv2.imread(str(image)), back.image_turns).astype(int)
        assert np.abs(seen - picture()).max() < 25  # JPEG
    if format_ in (record3d, nerfcapture):
        assert back.depth is None
        return
    np.testing.assert_allclose(back.depth.times, session.depth.times, rtol=0, atol=6e-7)
    for i, file in enumerate(back.depth.files):
        np.testing.assert_allclose(back.depth.load(file), 1 + 5 * i / 1000, atol=1e-6)


@each(*PICTURES)
def test_written_again_it_is_the_same(take: MakeTake, tmp_path: Path, format_: Format):
    """Portrait images of Record3D are copied, not turned twice."""
    session = with_pictures(take(4), tmp_path / "pictures")
    first = format_.read(write_session(format_, session, tmp_path / "first"))
    second = format_.read(write_session(format_, first, tmp_path / "second"))
    np.testing.assert_allclose(second.T_world_phone, first.T_world_phone, rtol=0, atol=1e-12)
    np.testing.assert_allclose(second.intrinsics, first.intrinsics, rtol=0, atol=1e-9)
    assert [f.read_bytes() for f in second.images] == [f.read_bytes() for f in first.images]


def test_images_outside_the_folder_are_not_there(take: MakeTake, tmp_path: Path):
    session = with_pictures(take(0), tmp_path / "pictures")
    folder = write_session(nerfstudio, session, tmp_path / "take")
    outside = {
        0: "../pictures/0.png",
        3: str(tmp_path / "pictures" / "3.png"),
        6: "x" * 5000 + "\0",
    }

    def lead_out(values: dict) -> None:
        for frame, file in outside.items():
            values["frames"][frame]["file_path"] = file

    edit_json(folder / "transforms.json", lead_out)
    images = nerfstudio.read(folder).images
    assert [image.name for image in images[:2]] == ["frame_00009.png", "frame_00012.png"]


def _with_depth(session: CaptureSession) -> tuple[CaptureSession, np.ndarray]:
    metres = np.random.default_rng(1).uniform(0, 5, (192, 256)).astype(np.float32).round(3)
    times = session.times[[3, 20]]
    files = (Path("a"), Path("b"))
    log = DepthLog(times, files, lambda file: metres if file.name == "a" else metres * 0)
    return replace(session, depth=log), metres


@each(scan_capture, arkitscenes, stray_scanner)
def test_depth_maps_travel(take: MakeTake, tmp_path: Path, format_: Format):
    session, metres = _with_depth(take(0))
    back = format_.read(write_session(format_, session, tmp_path)).depth
    assert back is not None
    np.testing.assert_allclose(back.times, session.times[[3, 20]], rtol=0, atol=1e-6)
    np.testing.assert_allclose(back.load(back.files[0]), metres, rtol=0, atol=1e-6)
    assert not back.load(back.files[1]).any()
    back.files[0].write_bytes(back.files[0].read_bytes()[:-7000])
    error = error_of(back.files[0], back.load)
    assert error.code == "depth-damaged"
    assert error.where == str(back.files[0])


def test_depth_maps_that_are_none(take: MakeTake, tmp_path: Path):
    folder = write_session(scanner_3d, take(0), tmp_path)
    depth = folder / "depth_00003.png"
    for data in (b"", b"\x89PNG\r\n\x1a\n", b"\x89PNG\r\n\x1a\n" + b"\xff" * 40):
        depth.write_bytes(data)
        session = scanner_3d.read(folder)
        error = error_of(depth, session.depth.load)
        assert error.code == "depth-damaged"
        assert error.where == str(depth)
