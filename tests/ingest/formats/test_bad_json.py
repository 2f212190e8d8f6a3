"""A JSON log that is not as its app writes it is an error that names the file, never a bent path."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ingest.formats import json_log, nerfcapture
from ingest.formats.json_log import load_object, numbers_at
from ingest.formats.registry import Format
from omomo_core.errors import InputError
from tests.ingest.formats.logs import OBJECTS, PICTURES, MakeTake, each, error_of, write_log
from tests.log_writers import write_session


@each(*OBJECTS)
def test_damage_of_the_file(take: MakeTake, tmp_path: Path, format_: Format):
    log = write_log(format_, take(0), tmp_path)
    whole = log.read_text()
    for text, code in (
        (whole[: len(whole) // 2], "log-truncated"),
        ("", "log-truncated"),
        (whole + "}", "log-damaged"),
        ("[1, 2]", "log-damaged"),
        ('{"a": ' * 100_000, "log-damaged"),
        ('{"a": 1' + "0" * 5000 + "}", "log-damaged"),
    ):
        log.write_text(text)
        error = error_of(log, format_.read)
        assert error.code == code
        assert str(log) in error.where
        assert error.fix
    log.write_bytes(b'{"poses": "\xff"}')
    assert error_of(log, format_.read).code == "log-damaged"


@each(*PICTURES)
def test_an_object_of_something_else(take: MakeTake, tmp_path: Path, format_: Format):
    log = write_log(format_, take(0), tmp_path)
    log.write_text("{}")
    error = error_of(log, format_.read)
    assert error.code == "log-key-missing"
    assert str(log) in error.where
    assert error.fix


def test_a_file_too_large(take: MakeTake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    folder = write_session(nerfcapture, take(0), tmp_path)
    monkeypatch.setattr(json_log, "MAX_JSON_BYTES", 1000)
    assert error_of(folder, nerfcapture.read).code == "log-too-large"


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=6,
)


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_other_value_anywhere_is_an_error_or_harmless(
    take: MakeTake, tmp_path: Path, data: st.DataObject
):
    """A value of any kind in place of any other: no traceback, and never another path."""
    format_ = data.draw(st.sampled_from(OBJECTS))
    log = write_log(format_, take(5), tmp_path / format_.NAME)
    before = format_.read(log).T_world_phone
    values = at = json.loads(log.read_text())
    while True:
        keys = list(at) if isinstance(at, dict) else list(range(len(at)))
        key = data.draw(st.sampled_from(keys))
        if not (isinstance(at[key], dict | list) and at[key] and data.draw(st.booleans())):
            break
        at = at[key]
    was_number = isinstance(at[key], float)
    at[key] = data.draw(json_values)
    log.write_text(json.dumps(values, allow_nan=True))
    try:
        back = format_.read(log)
    except InputError:
        return
    if not was_number:
        np.testing.assert_allclose(back.T_world_phone, before, rtol=0, atol=1e-9)


def test_numbers_of_a_file_keep_their_shape(tmp_path: Path):
    log = tmp_path / "a.json"
    log.write_text('{"rows": [[1, 2.5], [3, 4], [5, 6e2]], "one": 7}')
    values = load_object(log)
    rows = numbers_at(values["rows"], (None, 2), log, "rows")
    np.testing.assert_array_equal(rows, [[1, 2.5], [3, 4], [5, 600]])
    assert numbers_at(values["one"], (), log, "one") == 7
    with pytest.raises(InputError, match=r"rows\[0\] of a.json is a list of 2 instead of"):
        numbers_at(values["rows"], (3, 3), log, "rows")
