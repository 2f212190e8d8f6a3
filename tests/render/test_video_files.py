"""Videos, animations, PNGs and contact sheets come back as they were written."""

from collections.abc import Iterator
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from PIL import Image

from omomo_core.errors import InputError
from render.video import contact_sheet, write_moving, write_png, write_video, write_webp
from tests.video_frames import read_frames


def ramp(count: int, height: int = 90, width: int = 160) -> Iterator[np.ndarray]:
    """Smooth pictures that differ from frame to frame."""
    y, x = np.mgrid[0 : 1 : height * 1j, 0 : 1 : width * 1j]
    for k in range(count):
        blue = np.full_like(x, k / count)
        yield (np.stack([x, y, blue], axis=-1) * 255).astype(np.uint8)


@pytest.mark.parametrize("fps", [30.0, 60.0, 29.97])
def test_a_video_keeps_its_frames_size_rate_and_codec(tmp_path: Path, fps: float) -> None:
    path = tmp_path / "clip.mp4"
    assert write_video(path, ramp(25), fps) == 25
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        assert (stream.width, stream.height, stream.frames) == (160, 90, 25)
        assert float(stream.average_rate or 0) == pytest.approx(fps)
    data = path.read_bytes()
    assert data.find(b"moov") < data.find(b"mdat")  # plays while it downloads
    assert [p.name for p in tmp_path.iterdir()] == ["clip.mp4"]


def test_colours_survive(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"
    write_video(path, ramp(12))
    sent = list(ramp(12))
    for index, frame in zip((7, 2), read_frames(path, (7, 2)), strict=True):
        assert np.abs(frame.astype(int) - sent[index]).mean() < 4.0


def test_odd_sizes_become_even(tmp_path: Path) -> None:
    path = tmp_path / "odd.mp4"
    write_video(path, ramp(3, 61, 83))
    assert read_frames(path, [0])[0].shape == (62, 84, 3)


def test_a_failed_video_leaves_nothing_and_keeps_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"
    write_video(path, ramp(4))
    before = path.read_bytes()

    def broken() -> Iterator[np.ndarray]:
        yield from ramp(3)
        raise RuntimeError("the renderer died")

    with pytest.raises(RuntimeError):
        write_video(path, broken())
    with pytest.raises(InputError, match="Picture 1 is 50x40"):
        write_video(path, [*ramp(1), *ramp(1, 40, 50)])
    with pytest.raises(InputError, match="no picture"):
        write_video(path, [])
    assert path.read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 1


def test_a_webp_animates(tmp_path: Path) -> None:
    path = tmp_path / "loop.webp"
    assert write_webp(path, ramp(10), 15.0) == 10
    found, animation = cv2.imreadanimation(str(path))
    assert found
    assert len(animation.frames) == 10


def test_a_gif_animates_at_its_own_rate_in_its_own_colours(tmp_path: Path) -> None:
    path = tmp_path / "loop.gif"
    assert write_moving(path, ramp(10), 15.0) == 10
    with Image.open(path) as animation:
        assert animation.n_frames == 10
        shown = []
        for k in range(10):
            animation.seek(k)
            shown.append(animation.info["duration"])
            seen = np.asarray(animation.convert("RGB")).astype(int)
            assert np.abs(seen - list(ramp(10))[k]).mean() < 6.0
    assert sum(shown) == pytest.approx(1000 * 10 / 15, abs=15)


@pytest.mark.parametrize("name", ["clip.mp4", "loop.webp", "loop.gif", "still.png"])
def test_a_full_disk_a_folder_and_no_folder_are_said_and_leave_nothing(
    tmp_path: Path, name: str
) -> None:
    def write(path: Path) -> object:
        if path.suffix == ".png":
            return write_png(path, next(ramp(1)))
        return write_moving(path, ramp(30), 30.0)

    (tmp_path / f".partial.{name}").symlink_to("/dev/full")  # writing to it finds no space
    with pytest.raises(InputError) as full:
        write(tmp_path / name)
    with pytest.raises(InputError) as missing:
        write(tmp_path / "none" / name)
    (tmp_path / name).mkdir()
    with pytest.raises(InputError) as folder:
        write(tmp_path / name)
    codes = [refused.value.code for refused in (full, missing, folder)]
    assert codes == ["disk-full", "output-not-writable", "output-is-folder"]
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_png_and_contact_sheet(tmp_path: Path) -> None:
    pictures = list(ramp(5))
    sheet = contact_sheet(pictures, 3, gap=2)
    assert sheet.shape == (2 * 90 + 2, 3 * 160 + 4, 3)
    assert (sheet[92:, 162:322] == pictures[4]).all()
    assert (sheet[92:, 324:] == 255).all()
    write_png(tmp_path / "sheet.png", sheet)
    back = cv2.imread(str(tmp_path / "sheet.png"))
    assert back is not None
    assert (back[..., ::-1] == sheet).all()
    with pytest.raises(InputError):
        contact_sheet([], 3)
