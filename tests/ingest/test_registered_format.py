"""A format that a script registers is read like those that are built in."""

from dataclasses import replace
from pathlib import Path

import pytest

from ingest.formats import registry, tum
from ingest.formats.registry import FORMATS, known_formats, read_session, register_format
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from tests.log_writers import write_session


class Renamed:
    """TUM's layout in a file of another ending."""

    NAME = "My App"
    FILES = "a folder with poses.mine"
    LACKS = "everything but poses"

    def __init__(self, note: str) -> None:
        self.note = note

    def detect(self, path: Path) -> bool:
        return (path / "poses.mine").is_file()

    def read(self, path: Path) -> CaptureSession:
        session = tum.read(path / "poses.mine")
        return replace(session, app=self.NAME, notes=(self.note,))

    def write(self, session: CaptureSession, folder: Path) -> Path:
        write_session(tum, session, folder)
        (folder / "trajectory.txt").rename(folder / "poses.mine")
        return folder


@pytest.fixture(autouse=True)
def nothing_registered(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(registry, "_REGISTERED", [])


def test_it_is_read_by_what_it_holds_and_by_its_name(wander, tmp_path: Path):
    folder = Renamed("").write(wander(0, seconds=1.2, rate=20), tmp_path / "log")
    with pytest.raises(InputError) as refused:
        read_session(folder)
    assert refused.value.code == "session-unknown"
    register_format(Renamed("mine"))
    for session in (read_session(folder), read_session(tmp_path, "my app")):
        assert session.app == "My App"
        assert session.notes == ("mine",)


def test_a_later_one_of_the_same_name_takes_its_place(wander, tmp_path: Path):
    folder = Renamed("").write(wander(0, seconds=1.2, rate=20), tmp_path / "log")
    register_format(Renamed("first"))
    register_format(Renamed("second"))
    assert known_formats()[:-1] == FORMATS
    assert read_session(folder).notes == ("second",)


def test_a_name_that_is_built_in_is_refused():
    format_ = Renamed("")
    format_.NAME = "tum"
    with pytest.raises(InputError) as refused:
        register_format(format_)
    assert refused.value.code == "format-known"
    assert known_formats() == FORMATS
