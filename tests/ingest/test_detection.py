"""No format claims what another one wrote, and no garbage makes the look for a format fail."""

import os
import time
from pathlib import Path

import pytest

from ingest.formats import ios_logger, pose_table
from ingest.formats.registry import FORMATS, Format, read_session
from omomo_core.errors import InputError
from tests.log_writers import write_session

every_format = pytest.mark.parametrize("format_", FORMATS, ids=lambda f: f.NAME)


def _claims(path: Path) -> list[str]:
    return [format_.NAME for format_ in FORMATS if format_.detect(path)]


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


@every_format
def test_exactly_one_format_claims_a_session(wander, tmp_path: Path, format_: Format):
    written = write_session(format_, wander(0, seconds=1.2, rate=20), tmp_path / "take")
    assert _claims(written) == [format_.NAME]
    assert read_session(written).app == format_.NAME


@every_format
def test_a_single_file_is_claimed_by_no_other_format(wander, tmp_path: Path, format_: Format):
    """Each file as it lies, and each by itself under a name that says nothing."""
    for i, file in enumerate(
        _files(write_session(format_, wander(0, seconds=1.2, rate=20), tmp_path / "take"))
    ):
        assert _claims(file) in ([], [format_.NAME]), file
        renamed = tmp_path / f"{i}.log"
        renamed.write_bytes(file.read_bytes())
        # Eight numbers without a name over them are anybody's: that is asked about.
        anybodys = [pose_table.NAME] if format_ is ios_logger and file.name == "ARposes.txt" else []
        claims = [name for name in _claims(renamed) if name not in anybodys]
        assert claims in ([], [format_.NAME]), file


def test_what_describes_the_formats():
    assert len({format_.NAME for format_ in FORMATS}) == len(FORMATS)
    for format_ in FORMATS:
        assert isinstance(format_, Format)
        assert format_.FILES
        assert format_.LACKS
        assert "\n" not in format_.FILES + format_.LACKS


def _empty(path: Path) -> None:
    path.touch()


def _binary(path: Path) -> None:
    path.write_bytes(bytes(range(256)) * 64)


def _huge(path: Path) -> None:
    """Two gigabytes of zeros, which take no room."""
    path.touch()
    os.truncate(path, 2**31)


def _one_endless_line(path: Path) -> None:
    path.write_bytes(b"1," * 2**20)


def _nested(path: Path) -> None:
    path.write_bytes(b"[" * 100_000)


def _nested_object(path: Path) -> None:
    path.write_bytes(b'{"time":' * 100_000)


def _long_numbers(path: Path) -> None:
    number = b"9" * 5000
    path.write_bytes(b'{"time": %b}\n' % number + b" ".join([number] * 8) + b"\n")


def _other_digits(path: Path) -> None:
    path.write_text(" ".join(["²", "٣٤٥٦٧٨٩٠١٢٣", *"1234567"]) + "\n" + ",".join("²٣1234567"))


def _folder(path: Path) -> None:
    path.mkdir()


def _dangling_link(path: Path) -> None:
    path.symlink_to(path.parent / "nowhere")


def _link_to_itself(path: Path) -> None:
    path.symlink_to(path)


@pytest.fixture(scope="module")
def names(wander, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """What the files of a session of each format are called."""
    session = wander(0, seconds=1.2, rate=5)
    top = tmp_path_factory.mktemp("names")
    folders = [write_session(format_, session, top / format_.NAME) for format_ in FORMATS]
    firsts = {(f.parent, f.suffix): f for folder in folders for f in reversed(_files(folder))}
    found = {f.relative_to(folder) for f in firsts.values() for folder in folders
             if f.is_relative_to(folder)}  # fmt: skip
    return sorted(found)


@pytest.mark.parametrize(
    "garbage",
    [
        *(_empty, _binary, _huge, _one_endless_line, _nested, _nested_object, _long_numbers),
        *(_other_digits, _folder, _dangling_link, _link_to_itself),
    ],
)
def test_garbage_is_looked_at_without_harm(tmp_path: Path, names: list[Path], garbage):
    """Under every name that a format looks for, alone and all together."""
    for i, name in enumerate(names):
        for top in (tmp_path / f"{i}", tmp_path / "all"):
            (top / name).parent.mkdir(parents=True, exist_ok=True)
            garbage(top / name)
        started = time.process_time()
        for format_ in FORMATS:
            assert format_.detect(tmp_path / f"{i}") in (True, False)
            assert format_.detect(tmp_path / f"{i}" / name) in (True, False)
        assert time.process_time() - started < 2
        for path in (tmp_path / f"{i}", tmp_path / f"{i}" / name, tmp_path / "all"):
            with pytest.raises(InputError):
                read_session(path)


def test_a_pipe_is_not_waited_for(tmp_path: Path):
    os.mkfifo(tmp_path / "odometry.csv")
    for path in (tmp_path, tmp_path / "odometry.csv"):
        with pytest.raises(InputError) as caught:
            read_session(path)
        assert caught.value.code == "session-unknown"


@every_format
def test_nothing_there_is_claimed_by_nobody(tmp_path: Path, format_: Format):
    assert not format_.detect(tmp_path / "nowhere")
    assert not format_.detect(tmp_path)
