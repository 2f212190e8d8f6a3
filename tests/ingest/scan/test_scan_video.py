"""A video given for a scan: some of its frames, turned upright as it says."""

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from ingest.film import film_at, pairs_of
from ingest.scan.scan_sources import VideoFrames, read_source
from omomo_core.errors import InputError


def _film(path: Path, count: int) -> list[np.ndarray]:
    """A video whose frames are told apart by their brightness; a key frame every 12."""
    pictures = [np.full((48, 64, 3), 5 * k % 250, np.uint8) for k in range(count)]
    for picture in pictures:
        picture[:12, :16] = 255  # the top left corner
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.options = {"crf": "5", "g": "12"}
        for k, picture in enumerate(pictures):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = k, Fraction(1, 30)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return pictures


def test_some_frames_of_a_video_in_order(tmp_path: Path):
    path = tmp_path / "film.mp4"
    pictures = _film(path, 40)
    source = read_source(path)
    assert source.kind == "video"
    assert len(source.pictures.names) == 40
    assert source.times is not None
    np.testing.assert_allclose(np.diff(source.times), 1 / 30, atol=1e-3)
    wanted = [0, 3, 13, 25, 39]
    found = dict(source.pictures.colours(wanted))
    assert list(found) == wanted
    for k in wanted:
        assert abs(int(found[k][40, 40, 0]) - int(pictures[k][40, 40, 0])) < 8
    greys = dict(source.pictures.greys([39], 32))
    assert greys[39].shape == (24, 32)


def test_a_video_held_upright_is_turned_as_it_says(tmp_path: Path):
    path = tmp_path / "film.mp4"
    _held_upright(tmp_path, path)
    picture = dict(read_source(path).pictures.colours([2]))[2]
    assert picture.shape == (64, 48, 3)
    # Phones state 90 degrees clockwise: the stored top left becomes the top right.
    assert picture[4, -4].mean() > 240
    assert picture[4, 4].mean() < 60


def _held_upright(folder: Path, path: Path) -> None:
    """The same film with the matrix that an upright phone writes into the track header."""
    plain = folder / "plain.mp4"
    _film(plain, 6)
    data = bytearray(plain.read_bytes())
    at = data.index(b"tkhd") + 4 + 40
    matrix = [0, 1, 0, -1, 0, 0, 0, 0, 1]
    one = [1 << 16, 1 << 16, 1 << 30] * 3
    packed = b"".join(
        (m * o).to_bytes(4, "big", signed=True) for m, o in zip(matrix, one, strict=True)
    )
    data[at : at + 36] = packed
    path.write_bytes(bytes(data))


def test_a_video_that_is_none(tmp_path: Path):
    path = tmp_path / "film.mov"
    path.write_bytes(b"no video" * 50)
    with pytest.raises(InputError) as caught:
        read_source(path)
    assert caught.value.code == "no-video"


def test_a_film_without_its_first_frame_keeps_the_numbers_of_the_log(tmp_path: Path):
    path = tmp_path / "film.mp4"
    pictures = _film(path, 10)
    pairs = pairs_of(film_at(path), np.arange(11) / 30)
    assert pairs.images.tolist() == list(range(1, 11))
    film = VideoFrames(path, tuple(str(k) for k in pairs.images), 0, tuple(pairs.frames.tolist()))
    found = dict(film.colours([0, 9]))
    assert abs(int(found[9][40, 40, 0]) - int(pictures[9][40, 40, 0])) < 8
