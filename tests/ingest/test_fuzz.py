"""Whatever happens to the bytes of a log, it reads as a valid session or is refused by name."""

import contextlib
import json
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from ingest.formats.registry import FORMATS, Format, read_session
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from tests.log_writers import write_session

every_format = pytest.mark.parametrize("format_", FORMATS, ids=lambda f: f.NAME)
NUMBERS = (
    *(b"nan", b"inf", b"-inf", b"1e400", b"1e200", b"-1e155", b"1e-320", b"", b"0", b"-1", b"NaN"),
    *(b"9" * 20, b"9" * 400, b"9" * 5000, b"0x10", b"1_0", b"1,5", b"--1", b'"1"', b"null"),
    *("٣".encode(), "１２".encode(), "²".encode(), b"1\xff", b"true", b"1.5.2", b"-0.0"),
)
VALUES: tuple[Any, ...] = (
    *(None, True, 0, -1, 1e308, 10**400, "", "x", "../../etc/passwd", "/dev/zero", "\0", "NaN"),
    *([], {}, [[]], [None], [1, "a"], {"": None}, [0] * 7, [[0, 0, 0, 0]] * 4, [1e200] * 16),
)
Draw = Callable[[st.SearchStrategy[Any]], Any]


def _position(draw: Draw, data: bytes) -> int:
    return draw(st.integers(0, max(0, len(data) - 1)))


def _flip(draw: Draw, data: bytes) -> bytes:
    at = _position(draw, data)
    return data[:at] + bytes([draw(st.integers(0, 255))]) + data[at + 1 :]


def _delete(draw: Draw, data: bytes) -> bytes:
    at = _position(draw, data)
    return data[:at] + data[at + draw(st.integers(1, 80)) :]


def _insert(draw: Draw, data: bytes) -> bytes:
    at = _position(draw, data)
    return data[:at] + draw(st.binary(max_size=12)) + data[at:]


def _truncate(draw: Draw, data: bytes) -> bytes:
    return data[: _position(draw, data)]


def _swap_lines(draw: Draw, data: bytes) -> bytes:
    lines = data.split(b"\n")
    one, other = (draw(st.integers(0, len(lines) - 1)) for _ in range(2))
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def _repeat_line(draw: Draw, data: bytes) -> bytes:
    lines = data.split(b"\n")
    at = draw(st.integers(0, len(lines) - 1))
    return b"\n".join([*lines[:at], *[lines[at]] * draw(st.sampled_from([0, 2, 3])), *lines[at:]])


def _replace_number(draw: Draw, data: bytes) -> bytes:
    """Put something else where a number or a word stands."""
    at = _position(draw, data)
    ends = b" ,\n\r[]{}:"
    start = next((i + 1 for i in range(at - 1, -1, -1) if data[i] in ends), 0)
    stop = next((i for i in range(at, len(data)) if data[i] in ends), len(data))
    return data[:start] + draw(st.sampled_from(NUMBERS)) + data[stop:]


def _replace_json(draw: Draw, data: bytes) -> bytes:
    """Put another value, or very many brackets, somewhere into a JSON text (or its first line)."""
    first, _, others = data.partition(b"\n")
    for text, rest in ((data, b""), (first, others)):
        with contextlib.suppress(ValueError, RecursionError):
            value = json.loads(text)
            mark = "the value that is replaced"
            deep = b"[" * 20_000 + b"]" * 20_000
            changed = json.dumps(_with(draw, value, draw(st.sampled_from([*VALUES, mark]))))
            return changed.encode().replace(json.dumps(mark).encode(), deep) + b"\n" + rest
    return data


def _with(draw: Draw, value: Any, new: Any) -> Any:
    """The value with something in it replaced or, for objects, left out."""
    if not isinstance(value, dict | list) or not value or draw(st.integers(0, 4)) == 0:
        return new
    keys = list(value) if isinstance(value, dict) else list(range(len(value)))
    key = draw(st.sampled_from(keys))
    changed = value.copy()
    if draw(st.integers(0, 5)) == 0:
        del changed[key]
    else:
        changed[key] = _with(draw, value[key], new)
    return changed


MUTATIONS = (_flip, _delete, _insert, _truncate, _swap_lines, _repeat_line, _replace_number)


@cache
def _written(format_: Format, make: Callable[..., CaptureSession]) -> dict[str, bytes]:
    """The text files of a small session."""
    with tempfile.TemporaryDirectory() as folder:
        top = write_session(format_, make(0, seconds=1.5, rate=8), Path(folder) / "take")
        files = {str(f.relative_to(top)): f.read_bytes() for f in top.rglob("*") if f.is_file()}
    return {name: data for name, data in files.items() if b"\0" not in data}


def _mutated(draw: Draw, data: bytes) -> bytes:
    is_json = data.lstrip().startswith((b"{", b"["))
    for _ in range(draw(st.integers(1, 3))):
        data = draw(st.sampled_from([*MUTATIONS, *[_replace_json] * 7 * is_json]))(draw, data)
    return data


def _check(session: CaptureSession) -> None:
    """What whoever takes a session may rely on."""
    frames = len(session.times)
    T = session.T_world_phone
    assert frames >= 2
    assert 1 <= session.times[-1] - session.times[0] <= 86400
    assert (np.diff(session.times) > 0).all()
    assert T.shape == (frames, 4, 4)
    assert np.abs(T).max() < 1e6
    np.testing.assert_allclose(T[:, :3, :3] @ T[:, :3, :3].transpose(0, 2, 1), [np.eye(3)] * frames,
                               atol=1e-9)  # fmt: skip
    if session.intrinsics is not None:
        assert session.intrinsics.shape == (frames, 4)
        assert np.isfinite(session.intrinsics).all()
    if session.image_size is not None:
        assert min(session.image_size) > 0
    if session.tracking_ok is not None:
        assert session.tracking_ok.shape == (frames,)
    if session.video_times is not None:
        assert np.isfinite(session.video_times).all()
    if session.images is not None:
        assert session.video_times is not None
        assert len(session.images) == len(session.video_times)
    if session.imu is not None:
        assert (np.diff(session.imu.times) >= 0).all()
        assert all(np.isfinite(x).all() for x in vars(session.imu).values())


def _fuzz(make: Callable[..., CaptureSession], format_: Format, data: st.DataObject) -> None:
    files = _written(format_, make)
    name = data.draw(st.sampled_from(sorted(files)))
    files = files | {name: _mutated(data.draw, files[name])}
    with tempfile.TemporaryDirectory() as folder:
        for file, content in files.items():
            (Path(folder) / file).parent.mkdir(parents=True, exist_ok=True)
            (Path(folder) / file).write_bytes(content)
        try:
            session = read_session(Path(folder))
        except InputError:
            return
        _check(session)


# Drawn bytes do not shrink well, and a failure shows its few changes as it is.
some = settings(suppress_health_check=list(HealthCheck), phases=[
    Phase.explicit, Phase.reuse, Phase.generate])  # fmt: skip


@every_format
@settings(some, max_examples=25)
@given(data=st.data())
def test_a_damaged_log_is_refused_or_valid(wander, format_: Format, data: st.DataObject):
    _fuzz(wander, format_, data)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@every_format
@settings(some, max_examples=1_000)
@given(data=st.data())
def test_many_damaged_logs(wander, format_: Format, data: st.DataObject):
    _fuzz(wander, format_, data)
