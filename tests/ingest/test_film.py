"""Films: which frame is which image of a log, how they are to be shown, and what is wrong with them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ingest.film import Turning, check_decodes, film_at, frames_of, pairs_of, turning_of
from ingest.formats import stray_scanner
from ingest.formats.registry import read_session
from ingest.report.take_inspection import inspect_session
from ingest.session_images import film_and_pairs, pictures
from omomo_core.errors import InputError
from tests.stamped_film import RATE, film

TIMES = 65575.5 + np.arange(40) / RATE


def paired(
    path: Path, times: np.ndarray = TIMES, numbers: np.ndarray | None = None
) -> dict[int, int]:
    pairs = pairs_of(film_at(path), times, numbers)
    return dict(zip(pairs.frames.tolist(), pairs.images.tolist(), strict=True))


def test_as_many_frames_as_images_are_in_step(tmp_path: Path):
    path = film(tmp_path / "a.mp4", list(range(40)))
    assert paired(path) == {k: k for k in range(40)}
    uneven = TIMES + 0.2 * (
        np.arange(40) > 20
    )  # Stray Scanner counts frames, whatever the time was
    assert paired(path, uneven) == {k: k for k in range(40)}


@pytest.mark.parametrize("lost", [[20], list(range(10, 25)), [3, 4, 17, 30, 31, 32]])
def test_gaps_in_the_stamps_say_which_frames_are_lost(tmp_path: Path, lost: list[int]):
    kept = [k for k in range(40) if k not in lost]
    path = film(tmp_path / "a.mp4", kept)
    assert paired(path) == dict(enumerate(kept))
    # As many images as frames, but the log has lost its end and not what the film has lost.
    assert paired(path, TIMES[: len(kept)]) == {i: k for i, k in enumerate(kept) if k < len(kept)}


def test_stamps_that_begin_later_say_that_the_beginning_is_lost(tmp_path: Path):
    path = film(tmp_path / "a.mkv", list(range(12, 40)))
    assert paired(path) == {k: k + 12 for k in range(28)}


@pytest.mark.parametrize("lost", [[], [7], [7, 20], [0], [39]])
@pytest.mark.parametrize("seed", range(3))
def test_an_uneven_film_is_paired_by_its_stamps(tmp_path: Path, seed: int, lost: list[int]):
    """A variable frame rate: 17 to 50 pictures a second, and the log has the times of all."""
    seconds = np.cumsum(np.random.default_rng(seed).uniform(0.02, 0.06, 40))
    kept = [k for k in range(40) if k not in lost]
    path = film(tmp_path / "a.mkv", kept, seconds=seconds)
    assert paired(path, 65575.5 + seconds) == dict(enumerate(kept))


def _trimmed(path: Path, frames: int) -> Path:
    """Let the edit list of a film begin later, as a phone trims without encoding again."""
    data = bytearray(path.read_bytes())
    edit, clock = data.index(b"elst") + 16, data.index(b"mdhd") + 16
    begin, scale = (int.from_bytes(data[k : k + 4], "big") for k in (edit, clock))
    data[edit : edit + 4] = (begin + scale * frames // RATE).to_bytes(4, "big")
    path.write_bytes(data)
    return path


@pytest.mark.parametrize(("trimmed", "held"), [(7, 7), (13, 3)])
def test_a_trimmed_film_has_the_frames_that_it_shows(tmp_path: Path, trimmed: int, held: int):
    """What comes before the key frame of the first one is passed over; every tenth frame is a key."""
    path, count = _trimmed(film(tmp_path / "a.mp4", list(range(40))), trimmed), 40 - trimmed
    found = film_at(path)
    assert (len(found.stamps), found.cut) == (count, (held, 0))
    np.testing.assert_allclose(found.times, np.arange(count) / RATE, atol=1e-3)
    check_decodes(found)
    wanted = [0, 9, count - 1]
    grey = [f.to_ndarray(format="gray")[20:].mean() for _, f in frames_of(path, wanted)]
    np.testing.assert_allclose(grey, [6 * (k + trimmed) for k in wanted], atol=2)
    if held == trimmed:
        assert paired(path) == {k: k + trimmed for k in range(count)}
    else:  # nothing says how many are missing before the key frame
        with pytest.raises(InputError) as caught:
            paired(path)
        assert caught.value.code == "film-unpaired"


def test_numbers_of_the_log_say_which_rows_it_has_lost(tmp_path: Path):
    path = film(tmp_path / "a.mp4", list(range(40)))
    rows = np.array([k for k in range(40) if not 10 <= k < 20])
    assert paired(path, TIMES[rows], rows) == {int(k): i for i, k in enumerate(rows)}


def test_a_film_whose_stamps_are_the_times_of_fewer_images(tmp_path: Path):
    """ScanCapture stamps its film with the times of its poses (CVG, lamar: extract_frames_from_video)."""
    path = film(tmp_path / "a.mp4", list(range(0, 40, 2)))
    assert paired(path) == {i: 2 * i for i in range(20)}


def test_a_film_that_says_nothing_of_what_is_missing_is_not_paired(tmp_path: Path):
    path = film(tmp_path / "a.mp4", list(range(30)))
    with pytest.raises(InputError) as caught:
        pairs_of(film_at(path), TIMES)
    assert caught.value.code == "film-unpaired"
    assert "30 frames and the log 40 images" in caught.value.what


def test_a_session_with_lost_frames_uses_those_that_are_there(wander, tmp_path: Path):
    session = wander(0)
    kept = [k for k in range(len(session.times)) if not 12 <= k < 20]
    folder = stray_scanner.write(replace(session, video=None), tmp_path / "take")
    film(folder / "rgb.mp4", kept)
    back = read_session(folder)
    seen = pictures(back, [5, 15, 25])
    assert sorted(seen) == [5, 25]
    assert abs(int(seen[25][40, 40]) - 150) < 6
    check = next(c for c in inspect_session(back).checks if c.name == "video")
    assert check.severity == "warn"
    assert f"{len(kept)} are paired by the film's stamps" in check.message


IDENTITY = np.array([1, 0, 0, 0, 1, 0, 0, 0, 1])


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_display_matrix_turns_and_mirrors(turns: int, mirrored: bool):
    """Taken to where the matrix says, each pixel is where the turned picture has it (ISO 14496-12)."""
    c, s = round(np.cos(turns * np.pi / 2)), round(np.sin(turns * np.pi / 2))
    sign = -1 if mirrored else 1
    matrix = np.array([sign * c, -sign * s, 0, s, c, 0, 0, 0, 1]) * 65536
    assert turning_of(matrix) == Turning(turns, mirrored)
    picture = np.arange(12, dtype=np.uint8).reshape(3, 4)
    v, u = np.mgrid[:3, :4]
    x, y = (matrix[0] * u + matrix[3] * v) // 65536, (matrix[1] * u + matrix[4] * v) // 65536
    x, y = x - x.min(), y - y.min()
    out = np.zeros((y.max() + 1, x.max() + 1), np.uint8)
    out[y, x] = picture
    facing = picture[:, ::-1] if mirrored else picture
    np.testing.assert_array_equal(np.rot90(facing, turns), out)


def test_a_film_to_be_shown_mirrored_does_not_stand_on_its_head(tmp_path: Path):
    """PyAV 18 calls this matrix a turn by 180 degrees."""
    path = film(tmp_path / "a.mov", list(range(5)), matrix=[-1, 0, 0, 0, 1, 0, 0, 0, 1])
    found = film_at(path)
    assert found.turning == Turning(0, mirrored=True)
    assert found.upright_turns == 0


def test_a_title_of_damaged_bytes_is_no_fault(tmp_path: Path):
    path = film(tmp_path / "a.mp4", list(range(5)), title="QQQQQQ")
    data = path.read_bytes()
    assert data.count(b"QQQQQQ") == 1
    path.write_bytes(data.replace(b"QQQQQQ", b"\xff\xfe\xfd\xc3\x28\x80"))
    check_decodes(film_at(path))


def test_damage_is_told_in_plain_words(tmp_path: Path):
    path = film(tmp_path / "a.mp4", list(range(40)))
    whole = path.read_bytes()
    for damaged in (whole[: len(whole) // 2], b"no film", b"", b"\0" * 5000):
        path.write_bytes(damaged)
        with pytest.raises(InputError) as caught:
            film_at(path)
        assert caught.value.code == "no-video"
        for jargon in ("Errno", "avcodec", "Invalid data", "libav", "None", "moov"):
            assert jargon not in caught.value.what


def test_a_film_that_breaks_off_costs_what_is_missing_alone(tmp_path: Path):
    path = film(tmp_path / "a.mkv", list(range(40)))
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * 0.6)])
    found = film_at(path)
    assert 3 < len(found.stamps) < 40
    assert [k for k, _ in frames_of(path, [0, 2])] == [0, 2]


def test_a_damaged_film_costs_no_session(wander, tmp_path: Path):
    folder = stray_scanner.write(replace(wander(0), video=None), tmp_path / "take")
    (folder / "rgb.mp4").write_bytes(b"\0" * 999)
    back = read_session(folder)
    assert pictures(back, [0, 5]) == {}
    with pytest.raises(InputError):
        film_and_pairs(back, folder / "rgb.mp4")
    check = next(c for c in inspect_session(back).checks if c.name == "video")
    assert (check.severity, "motion does not need it" in check.fix) == ("warn", True)
