"""Which pictures a scan is made of: sharp ones, from all around, as many as asked for."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import pytest

from ingest.formats.still_images import load_millimetres
from ingest.scan.scan_pictures import blur, farthest_points, measure_pictures, narrowed, pick_frames
from ingest.scan.scan_types import ScanSource
from omomo_core.errors import InputError

SIZE = (320, 240)


@cache
def _wide() -> np.ndarray:
    """A large picture full of shapes."""
    rng = np.random.default_rng(0)
    wide = np.full((240, 1400, 3), 120, np.uint8)
    for _ in range(500):
        at = rng.integers(0, [1400, 240]).tolist()
        colour = rng.integers(0, 255, 3).tolist()
        cv2.rectangle(wide, at, (np.array(at) + rng.integers(4, 40, 2)).tolist(), colour, -1)
    return wide


def _view(shift: float) -> np.ndarray:
    """A part of it."""
    return _wide()[:, round(shift) : round(shift) + SIZE[0]]


@dataclass(frozen=True)
class Made:
    """Pictures that are made when they are asked for; some of them blurred."""

    shifts: tuple[float, ...]
    blurred: frozenset[int] = frozenset()
    damaged: frozenset[int] = frozenset()
    large: int = 1

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"shot {k}" for k in range(len(self.shifts)))

    def colours(self, wanted: Sequence[int]) -> Iterator[tuple[int, np.ndarray]]:
        for k in sorted({*wanted} - self.damaged):
            picture = _view(self.shifts[k])
            if k in self.blurred:
                picture = cv2.blur(picture, (15, 15))
            size = SIZE[0] * self.large, SIZE[1] * self.large
            yield k, np.ascontiguousarray(cv2.resize(picture, size))

    def greys(self, wanted: Sequence[int], width: int) -> Iterator[tuple[int, np.ndarray]]:
        for k, picture in self.colours(wanted):
            yield k, narrowed(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), width)


def _source(pictures: Made, where: Path) -> ScanSource:
    where.mkdir(exist_ok=True)
    return ScanSource("photos", where, pictures)


def _places(frames: object) -> list[int]:
    return [int(Path(f.name).stem) for f in frames.frames]  # pyright: ignore


def test_blurred_pictures_are_left_out_and_counted(tmp_path: Path):
    blurred = frozenset({3, 10, 11, 25})
    source = _source(Made(tuple(np.linspace(0, 900, 30)), blurred), tmp_path / "in")
    found = pick_frames(source, tmp_path / "work")
    assert set(_places(found)) == set(range(30)) - blurred
    assert (found.seen, found.blurred) == (30, 4)
    assert all(f.file.is_file() and f.size == SIZE for f in found.frames)


def test_pictures_are_spread_over_the_motion_and_not_over_the_time(tmp_path: Path):
    # The walk stops for two thirds of the film.
    shifts = (*np.linspace(0, 500, 30), *np.full(120, 500.0), *np.linspace(500, 1000, 30))
    source = _source(Made(shifts), tmp_path / "in")
    found = _places(pick_frames(source, tmp_path / "work", count=24))
    assert len(found) == 24
    resting = sum(30 <= k < 150 for k in found)
    assert resting < 12
    walked = np.sort([shifts[k] for k in found])
    assert np.diff(walked).max() < 130


def test_poses_spread_the_pictures_over_the_directions(tmp_path: Path):
    turn = np.concatenate([np.full(60, 0.0), np.linspace(0, 2 * np.pi, 60, endpoint=False)])
    T = np.tile(np.eye(4), (120, 1, 1))
    T[:, :3, 3] = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    T[:, :3, 2] = -T[:, :3, 3]
    T[100] = np.nan
    made = Made(tuple(np.linspace(0, 1000, 120)))
    source = replace(_source(made, tmp_path / "in"), T_world_camera=T)
    found = pick_frames(source, tmp_path / "work", count=30)
    places = np.array(_places(found))
    assert 100 not in places
    around = np.sort(turn[places])
    assert np.diff([*around, 2 * np.pi]).max() < 0.5
    assert (places < 60).sum() < 6
    np.testing.assert_allclose(found.frames[3].T_world_camera, T[places[3]])


def test_of_near_pictures_the_sharper_is_taken():
    where = np.repeat(np.arange(10.0), 2)[:, None] + np.tile([0.0, 1e-3], 10)[:, None]
    worth = np.tile([0.6, 1.0], 10)
    assert set(farthest_points(where, worth, 10).tolist()) == set(range(1, 20, 2))


def test_large_pictures_are_kept_smaller_with_their_intrinsics(tmp_path: Path):
    made = Made(tuple(np.linspace(0, 900, 14)), large=10)
    K = np.tile([2400.0, 2400.0, 1599.5, 1199.5], (14, 1))
    depth = np.full((12, 16), 1.5, np.float32)
    source = replace(
        _source(made, tmp_path / "in"),
        image_size=(3200, 2400),
        intrinsics=K,
        depth=lambda k: depth if k else None,
    )
    found = pick_frames(source, tmp_path / "work")
    first = found.frames[0]
    assert first.size == (1600, 1200)
    assert first.intrinsics is not None
    np.testing.assert_allclose(first.intrinsics, [1200, 1200, 799.5, 599.5])
    assert first.depth is None
    assert found.frames[1].depth is not None
    np.testing.assert_allclose(load_millimetres(found.frames[1].depth), 1.5)


def test_frames_that_are_picked_are_not_picked_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    source = _source(Made(tuple(np.linspace(0, 900, 20))), tmp_path / "in")
    told: list[str] = []
    first = pick_frames(source, tmp_path / "work", progress=lambda s, _: told.append(s))
    assert set(told) == {"look", "frames"}
    told.clear()
    again = pick_frames(source, tmp_path / "work", progress=lambda s, _: told.append(s))
    assert told == []
    assert again == first
    monkeypatch.chdir(tmp_path)
    assert pick_frames(source, Path("work")) == first
    fewer = pick_frames(source, tmp_path / "work", count=12)
    assert len(fewer.frames) == 12
    assert len(list((tmp_path / "work" / "images").iterdir())) == 12


def test_too_few_pictures_and_all_blurred(tmp_path: Path):
    few = _source(Made((0.0, 5.0, 9.0)), tmp_path / "few")
    with pytest.raises(InputError) as caught:
        pick_frames(few, tmp_path / "work")
    assert caught.value.code == "scan-few"
    made = Made(tuple(np.linspace(0, 900, 30)), frozenset(range(30)))
    with pytest.raises(InputError) as caught:
        pick_frames(_source(made, tmp_path / "soft"), tmp_path / "work")
    assert caught.value.code == "scan-blurred"
    assert not (tmp_path / "work" / "frames.json").exists()


def test_many_blurred_pictures_are_told(tmp_path: Path):
    made = Made(
        tuple(np.linspace(0, 900, 40)), frozenset(range(0, 40, 5)) | frozenset(range(0, 40, 4))
    )
    found = pick_frames(_source(made, tmp_path / "in"), tmp_path / "work")
    assert [note.name for note in found.notes] == ["sharpness"]


def test_blur_rises_with_blur():
    grey = np.asarray(cv2.cvtColor(_view(0), cv2.COLOR_RGB2GRAY))
    values = [blur(grey), *(blur(np.asarray(cv2.blur(grey, (k, k)))) for k in (3, 7, 15))]
    assert values == sorted(values)
    assert values[0] < 0.4 < 0.62 < values[3]


def test_motion_is_measured_in_sizes_of_the_picture():
    looks = measure_pictures(Made(tuple(range(0, 100, 10))), list(range(10)), lambda done: None)
    np.testing.assert_allclose(np.diff(looks.path), 10 / 320, rtol=0.15)


def test_damaged_pictures_are_left_out_and_named(tmp_path: Path):
    """One of many is told of; a considerable part is refused, in the same words."""
    shifts = tuple(float(10 * k) for k in range(40))
    one = ScanSource("video", Path("a.mp4"), Made(shifts, damaged=frozenset({7})))
    picked = pick_frames(one, tmp_path / "one", count=20)
    said = {check.name: check.message for check in picked.notes}
    assert said == {"pictures": "1 of 40 pictures cannot be read and is left out: shot 7."}
    many = ScanSource("video", Path("a.mp4"), Made(shifts, damaged=frozenset(range(9))))
    with pytest.raises(InputError, match="9 of 40 pictures cannot be read: shot 0, shot 1") as bad:
        pick_frames(many, tmp_path / "many", count=20)
    assert bad.value.code == "pictures-damaged"
