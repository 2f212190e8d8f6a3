"""A format claims its own sessions, told by their content, and nothing else."""

import tempfile
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ingest.formats import anysense, arkitscenes, ios_logger, polycam, scanner_3d, tum
from ingest.formats.registry import FORMATS, Format, read_session
from omomo_core.errors import InputError
from tests.ingest.formats.logs import MakeTake, each, error_of, every_format, pose_file, write_log
from tests.log_writers import write_session


def _claims(path: Path) -> list[str]:
    return [format_.NAME for format_ in FORMATS if format_.detect(path)]


@every_format
def test_only_its_own_format_claims_a_session(take: MakeTake, tmp_path: Path, format_: Format):
    folder = write_session(format_, take(0), tmp_path / "take")
    for path in (folder, pose_file(format_, folder)):
        assert _claims(path) == [format_.NAME]
        assert read_session(path).app == format_.NAME


# A file of one pose is told from others by its name and folder.
# Eight numbers without a name over them are ios_logger's or anybody's.
@each(*(f for f in FORMATS if f not in (polycam, scanner_3d, ios_logger)))
def test_a_renamed_pose_file_is_known_by_its_content(
    take: MakeTake, tmp_path: Path, format_: Format
):
    log = write_log(format_, take(0), tmp_path / "take")
    renamed = tmp_path / "my take.log"
    renamed.write_bytes(log.read_bytes())
    assert _claims(renamed) == [format_.NAME]


def test_files_that_only_have_the_names_are_not_claimed(tmp_path: Path):
    junk = tmp_path / "junk"
    (junk / "keyframes" / "cameras").mkdir(parents=True)
    (junk / "keyframes" / "cameras" / "1.json").write_text('{"t_00": 1}')
    for name in ("metadata", "frame_00000.json", "frame_x.json", "transforms.json", "[]"):
        (junk / name).write_bytes(b"\xff\x00{" if name == "metadata" else b"{}")
    (junk / "metadata.json").mkdir()
    for path in (tmp_path / "nowhere", junk, *junk.iterdir()):
        assert _claims(path) == []


@settings(max_examples=30)
@given(
    head=st.sampled_from(
        [b"", b"{", b"[[", b'{"time": 1}\n', b'"<', b"# up: z\n", b"1 2 3 4 5 6 7"]
    ),
    tail=st.binary(max_size=200),
    ending=st.sampled_from(
        ["poses.txt", "data.jsonl", "a.json", "pose_intrinsic_imu.json", "a.traj"]
    ),
)
def test_looking_at_garbage_never_raises(head: bytes, tail: bytes, ending: str):
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / ending
        file.write_bytes(head + tail)
        for format_ in FORMATS:
            for path in (file, Path(folder)):
                if format_.detect(path):
                    with pytest.raises(InputError):
                        format_.read(path)


@each(anysense, tum, arkitscenes)
def test_several_takes_in_one_folder(take: MakeTake, tmp_path: Path, format_: Format):
    log = write_log(format_, replace(take(0), intrinsics=None), tmp_path)
    second = log.with_name(f"second{log.suffix}")
    second.write_bytes(log.read_bytes())
    error = error_of(tmp_path)
    assert error.code == "session-ambiguous"
    assert "second" in error.what
    assert len(read_session(second).times) == len(take(0).times)
