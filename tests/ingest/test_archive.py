"""An archive reads as the folder it holds; names and links that reach out of it are refused."""

import io
import random
import tarfile
import zipfile
from pathlib import Path

import numpy as np
import pytest

from ingest.archive import is_archive, unpack
from ingest.formats import stray_scanner
from ingest.formats.registry import read_session
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from tests.ingest.packing import (
    Pack,
    every_pack,
    files_in,
    pack_tar_gz,
    pack_zip,
    refused,
    unpack_here,
)

scratch = pytest.fixture(autouse=True, name="scratch")(unpack_here)


def _same(one: CaptureSession, other: CaptureSession) -> None:
    assert one.app == other.app
    np.testing.assert_array_equal(one.times, other.times)
    np.testing.assert_array_equal(one.T_world_phone, other.T_world_phone)
    np.testing.assert_array_equal(one.intrinsics, other.intrinsics)
    assert one.imu is not None
    assert other.imu is not None
    np.testing.assert_array_equal(one.imu.accel, other.imu.accel)


@every_pack
@pytest.mark.parametrize("around", ["", "./", "3f2a9c/", "shared/3f2a9c/"])
def test_an_archive_reads_as_its_folder(wander, tmp_path: Path, pack: Pack, around: str):
    folder = stray_scanner.write(wander(0), tmp_path / "session")
    (folder / "rgb.mp4").write_bytes(random.Random(0).randbytes(3 * 2**20))
    files = {around + name: data for name, data in files_in(folder).items()}
    extras = {"__MACOSX/" + around + "._odometry.csv": b"\0\5\x16\7", around + ".DS_Store": b"\0"}
    packed = pack(tmp_path / "a take without an ending", files | extras)
    session = read_session(packed)
    assert session.source == packed
    _same(session, read_session(folder))
    assert session.video is not None
    assert session.video.read_bytes() == (folder / "rgb.mp4").read_bytes()
    assert set(files_in(unpack(packed))) == {Path(name).as_posix() for name in files}


def test_the_same_archive_is_unpacked_once_and_a_changed_one_again(tmp_path: Path, scratch: Path):
    packed = pack_zip(tmp_path / "take.zip", {"a.txt": b"one"})
    assert unpack(packed) == unpack(packed)
    assert len(list(scratch.iterdir())) == 1
    pack_zip(packed, {"a.txt": b"three"})
    assert (unpack(packed) / "a.txt").read_bytes() == b"three"


def test_a_defect_in_the_log_names_the_archive(wander, tmp_path: Path):
    files = files_in(stray_scanner.write(wander(0), tmp_path / "session"))
    lines = files["odometry.csv"].split(b"\n")
    lines[20] = lines[20][:25]
    files["odometry.csv"] = b"\n".join(lines)
    packed = pack_zip(tmp_path / "take.zip", files)
    with pytest.raises(InputError) as caught:
        read_session(packed)
    assert caught.value.code == "log-damaged"
    assert caught.value.where == f"{packed}/odometry.csv:21"


def test_an_archive_without_a_session_says_what_it_holds(tmp_path: Path):
    packed = pack_tar_gz(tmp_path / "take.tgz", {"holiday.jpg": b"\xff\xd8"})
    with pytest.raises(InputError, match=r"holiday\.jpg") as caught:
        read_session(packed)
    assert caught.value.code == "session-unknown"
    assert caught.value.where == str(packed)


@pytest.mark.parametrize("form", [tarfile.USTAR_FORMAT, tarfile.GNU_FORMAT, tarfile.PAX_FORMAT])
def test_long_names_and_letters_of_every_tar(tmp_path: Path, form: int):
    names = ["a/" + "folder-" * 12 + "/" + "x" * 90, "Gerät/日本.txt"]
    with tarfile.open(tmp_path / "take.tar", "w", format=form) as packed:
        for name in names:
            info = tarfile.TarInfo(name)
            info.size, info.mtime = 1000, 1700000000.25
            info.pax_headers = {"LIBARCHIVE.xattr.com.apple.quarantine": "x" * 5000}
            packed.addfile(info, io.BytesIO(b"n" * 1000))
    assert files_in(unpack(tmp_path / "take.tar")) == dict.fromkeys(names, b"n" * 1000)


@every_pack
@pytest.mark.parametrize(
    "name",
    [
        *("/etc/cron.d/x", "../x", "a/../../x", "C:/x", "c:x", "a\\..\\x", "a\nb"),
        *("x" * 256, "ab/" * 400 + "x", "/".join("abcdefghijklmnopqrs")),
    ],
)
def test_names_that_escape_or_fit_no_disk(tmp_path: Path, scratch: Path, pack: Pack, name: str):
    packed = pack(tmp_path / "take", {"odometry.csv": b"", name: b"x"})
    assert refused(packed, scratch).code == "archive-path"


def test_a_name_with_a_nul(tmp_path: Path, scratch: Path):
    packed = pack_zip(tmp_path / "take.zip", {"a.txt?.sh": b"x"})
    packed.write_bytes(packed.read_bytes().replace(b"a.txt?", b"a.txt\0"))
    assert refused(packed, scratch).code == "archive-path"


@pytest.mark.parametrize("kind", [b"1", b"2", b"3", b"4", b"6", b"S", b"?"])
def test_links_and_devices_in_a_tar(tmp_path: Path, scratch: Path, kind: bytes):
    with tarfile.open(tmp_path / "take.tar", "w") as packed:
        info = tarfile.TarInfo("odometry.csv")
        info.type, info.linkname = kind, "/etc/passwd"
        packed.addfile(info)
    assert refused(tmp_path / "take.tar", scratch).code == "archive-link"


@pytest.mark.parametrize("mode", [0o120777, 0o020666, 0o060666, 0o010666, 0o140777])
def test_links_and_devices_in_a_zip(tmp_path: Path, scratch: Path, mode: int):
    with zipfile.ZipFile(tmp_path / "take.zip", "w") as packed:
        info = zipfile.ZipInfo("odometry.csv")
        info.external_attr = mode << 16
        packed.writestr(info, "/etc/passwd")
    assert refused(tmp_path / "take.zip", scratch).code == "archive-link"


@every_pack
@pytest.mark.parametrize(
    "twins",
    [
        *(("a.txt", "a.txt#"), ("a.txt", "A.TXT"), ("x/b", "X/B"), ("a", "a/b")),
        *(("a/b", "a"), ("a", "A/b"), ("Ger\u00e4t", "Gera\u0308t")),
    ],
)
def test_names_that_meet_on_some_disk(tmp_path: Path, scratch: Path, pack: Pack, twins):
    packed = pack(tmp_path / "take", dict.fromkeys(twins, b"x"))
    assert refused(packed, scratch).code == "archive-duplicate"


def test_what_is_no_archive(tmp_path: Path):
    for name, data in {"empty": b"", "text": b"PK is no signature", "zeros": bytes(4096)}.items():
        (tmp_path / name).write_bytes(data)
        assert not is_archive(tmp_path / name)
