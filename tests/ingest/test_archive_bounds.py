"""An archive that would fill memory or disk, lies or is damaged is refused by name."""

import contextlib
import gzip
import random
import struct
import tarfile
import tracemalloc
import zipfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ingest import archive
from ingest.archive import unpack
from omomo_core.errors import InputError
from tests.ingest.packing import (
    Pack,
    every_pack,
    pack_tar,
    pack_tar_gz,
    pack_zip,
    refused,
    unpack_here,
)

scratch = pytest.fixture(autouse=True, name="scratch")(unpack_here)


def _zip_table(entries: int) -> bytes:
    name = b"x" * 8
    entry = struct.pack("<4s4B4H3L5H2L", b"PK\1\2", 20, 3, 20, 0, 0, 0, 0, 0, 0, 0, 0,
                        len(name), 0, 0, 0, 0, 0, 0) + name  # fmt: skip
    return entry * entries


def _zip_end(table: bytes, entries: int, start: int) -> bytes:
    zip64 = struct.pack(
        "<4sQ2H2L4Q", b"PK\6\6", 44, 45, 45, 0, 0, entries, entries, len(table), start
    )
    locator = struct.pack("<4sLQL", b"PK\6\7", 0, start + len(table), 1)
    most = 0xFFFF, 0xFFFF, 0xFFFFFFFF, 0xFFFFFFFF
    return zip64 + locator + struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, *most, 0)


@pytest.mark.parametrize(("claimed", "written"), [(1_000_000, 3), (3, 20_000), (20_000, 20_000)])
def test_a_zip_of_many_entries(tmp_path: Path, scratch: Path, monkeypatch, claimed, written):
    """Whether the end record says so or lies, nothing is made of any entry."""
    monkeypatch.setattr(archive, "MAX_ENTRIES", 2000)
    table, start = _zip_table(written), b"PK\3\4" + bytes(26)
    (tmp_path / "take.zip").write_bytes(start + table + _zip_end(table, claimed, len(start)))
    tracemalloc.start()
    try:
        error = refused(tmp_path / "take.zip", scratch)
        assert tracemalloc.get_traced_memory()[1] < 2**20
    finally:
        tracemalloc.stop()
    assert error.code == "archive-too-many-entries"


def test_a_zip_whose_table_alone_is_huge(tmp_path: Path, scratch: Path):
    with (tmp_path / "take.zip").open("wb") as file:
        file.write(b"PK\3\4")
        file.truncate(2**30)
        file.seek(0, 2)
        file.write(struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 3, 3, 2**30 - 4, 4, 0))
    assert refused(tmp_path / "take.zip", scratch).code == "archive-too-many-entries"


@every_pack
def test_too_many_entries(tmp_path: Path, scratch: Path, pack: Pack, monkeypatch):
    """Folders count, those that only a name tells too, and so does what is not unpacked."""
    monkeypatch.setattr(archive, "MAX_ENTRIES", 100)
    assert unpack(pack(tmp_path / "good", {f"{k}.txt": b"" for k in range(100)}))
    for folder in scratch.iterdir():
        folder.rename(tmp_path / "unpacked")
    for name in ("{}.txt", "__MACOSX/{}", "{}/a"):
        packed = pack(tmp_path / "bad", {name.format(k): b"" for k in range(101)})
        assert refused(packed, scratch).code == "archive-too-many-entries"
    packed = pack(tmp_path / "bad", {f"{k}/a/b/c.txt": b"" for k in range(40)})
    assert refused(packed, scratch).code == "archive-too-many-entries"


def test_a_tar_of_endless_entries_is_left_at_the_bound(tmp_path: Path, scratch: Path, monkeypatch):
    monkeypatch.setattr(archive, "MAX_ENTRIES", 2000)
    many = b"".join(tarfile.TarInfo(f"__MACOSX/{k}").tobuf() for k in range(5000))
    (tmp_path / "take.tgz").write_bytes(gzip.compress(many, 1) + b"damage that is never reached")
    assert refused(tmp_path / "take.tgz", scratch).code == "archive-too-many-entries"


def test_declared_sizes_are_bounded_before_anything_is_read(tmp_path: Path, scratch: Path):
    header = tarfile.TarInfo("rgb.mp4")
    header.size = archive.MAX_BYTES + 1
    (tmp_path / "take.tar").write_bytes(header.tobuf(tarfile.GNU_FORMAT))
    assert refused(tmp_path / "take.tar", scratch).code == "archive-too-large"
    header.size = archive.RATIO_FLOOR + 1
    (tmp_path / "take.tar").write_bytes(header.tobuf())
    assert refused(tmp_path / "take.tar", scratch).code == "archive-ratio"


@pytest.mark.parametrize("pack", [pack_zip, pack_tar_gz])
def test_a_bomb(tmp_path: Path, scratch: Path, pack: Pack, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(archive, "RATIO_FLOOR", 2**20)
    zeros = bytes(2**21)
    packed = pack(tmp_path / "take", {f"depth/{k}.png": zeros for k in range(4)})
    assert refused(packed, scratch).code == "archive-ratio"


def test_entries_that_share_their_bytes(tmp_path: Path, scratch: Path, monkeypatch):
    """The better bomb: a thousand entries of the table are one piece of the file."""
    monkeypatch.setattr(archive, "RATIO_FLOOR", 2**20)
    data = pack_zip(tmp_path / "take.zip", {"a" * 4: bytes(2**19)}).read_bytes()
    start = data.index(b"PK\1\2")
    end = data.index(b"PK\5\6")
    entry = data[start:end]
    table = b"".join(entry.replace(b"aaaa", b"%04d" % k) for k in range(1000))
    record = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 1000, 1000, len(table), start, 0)
    (tmp_path / "take.zip").write_bytes(data[:start] + table + record)
    assert refused(tmp_path / "take.zip", scratch).code == "archive-ratio"


def _with_size(packed: Path, size: int) -> None:
    """Let the table of contents of a zip with one entry claim another size."""
    data = bytearray(packed.read_bytes())
    struct.pack_into("<L", data, data.index(b"PK\1\2") + 24, size)
    packed.write_bytes(data)


def test_a_zip_that_lies_about_a_size(tmp_path: Path, scratch: Path):
    packed = pack_zip(tmp_path / "take.zip", {"a.txt": b"0123456789" * 100})
    _with_size(packed, 2000)
    assert refused(packed, scratch).code == "archive-size"
    _with_size(packed, 10)
    assert refused(packed, scratch).code == "archive-damaged"


def test_what_is_written_is_counted(tmp_path: Path, scratch: Path, monkeypatch):
    """Even if a reader gave more than the listing says, not more is written."""
    packed = pack_zip(tmp_path / "take.zip", {"a.txt": b"0123456789"})
    written: list[int] = []

    def endless(*_: object):
        while True:
            written.extend(p.stat().st_size for p in scratch.rglob("a.txt"))
            yield b"x" * 10

    monkeypatch.setattr("ingest.archive._zip_content", endless)
    assert refused(packed, scratch).code == "archive-size"
    assert len(written) == 2


def test_an_encrypted_zip(tmp_path: Path, scratch: Path):
    packed = pack_zip(tmp_path / "take.zip", {"a.txt": b"secret"})
    data = bytearray(packed.read_bytes())
    for signature, at in ((b"PK\3\4", 6), (b"PK\1\2", 8)):
        data[data.index(signature) + at] |= 1
    packed.write_bytes(data)
    error = refused(packed, scratch)
    assert error.code == "archive-encrypted"
    assert "password" in error.fix


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_methods_that_take_any_memory(tmp_path: Path, scratch: Path, method: int):
    with zipfile.ZipFile(tmp_path / "take.zip", "w", method) as packed:
        packed.writestr("a.txt", b"x" * 1000)
    assert refused(tmp_path / "take.zip", scratch).code == "archive-compression"


@pytest.mark.parametrize("size", [2**21, 2**40])
def test_a_tar_header_that_wants_any_memory(tmp_path: Path, scratch: Path, size: int):
    header = tarfile.TarInfo("x")
    header.type, header.size = tarfile.XHDTYPE, size
    block = header.tobuf(tarfile.GNU_FORMAT)
    (tmp_path / "take.tgz").write_bytes(gzip.compress(block + bytes(2**22), 1))
    assert refused(tmp_path / "take.tgz", scratch).code == "archive-damaged"


@pytest.mark.parametrize(
    "pax",
    [
        *(b"5 a=\n" * 100, b"0 path=x\n", b"99 path=x\n", b"-3 path=x\n", b"path"),
        *(b"11 size=1_0\n", b"9 size=x\n", b"12 size=\xd9\xa1\xd9\xa1\n"),
    ],
)
def test_damaged_extended_headers(tmp_path: Path, scratch: Path, pax: bytes):
    header = tarfile.TarInfo("x")
    header.type, header.size = tarfile.XHDTYPE, len(pax)
    block = header.tobuf() + pax.ljust(512, b"\0")
    (tmp_path / "take.tar").write_bytes(block + tarfile.TarInfo("a").tobuf() + bytes(1024))
    assert refused(tmp_path / "take.tar", scratch).code == "archive-damaged"
    (tmp_path / "take.tar").write_bytes(block * 1000)
    assert refused(tmp_path / "take.tar", scratch).code == "archive-damaged"


@every_pack
def test_cut_anywhere(tmp_path: Path, scratch: Path, pack: Pack):
    """However many bytes arrive, a cut archive is never taken for a shorter session."""
    noise = random.Random(1).randbytes(3000)
    whole = pack(tmp_path / "take", {"a.txt": noise[:1000], "b.txt": noise}).read_bytes()
    # Zeros that pad a tar may be missing, all but one block of them.
    needed = len(whole.rstrip(b"\0")) if pack is pack_tar else len(whole)
    cuts = range(512, needed, 97)
    for cut in [*cuts, needed - 1]:
        (tmp_path / "take").write_bytes(whole[:cut])
        assert refused(tmp_path / "take", scratch).code == "archive-damaged"


def test_gzip_of_something_else(tmp_path: Path, scratch: Path):
    (tmp_path / "take.tgz").write_bytes(gzip.compress(b"t,x,y,z\n" * 1000))
    assert refused(tmp_path / "take.tgz", scratch).code == "archive-damaged"


def test_more_after_the_end_of_a_tar(tmp_path: Path, scratch: Path):
    whole = gzip.decompress(pack_tar_gz(tmp_path / "take", {"a": b"x"}).read_bytes())
    (tmp_path / "take").write_bytes(gzip.compress(whole + bytes(2**21)))
    assert refused(tmp_path / "take", scratch).code == "archive-damaged"


@every_pack
def test_a_disk_without_room(tmp_path: Path, scratch: Path, pack: Pack, monkeypatch):
    packed = pack(tmp_path / "take", {"a.txt": b"x"})
    monkeypatch.setattr(archive, "_SPARE_BYTES", 2**60)
    error = refused(packed, scratch)
    assert error.code == "archive-disk"
    assert "TMPDIR" in error.fix


@settings(max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
@every_pack
def test_damage_anywhere_is_named(tmp_path: Path, scratch: Path, pack: Pack, data: st.DataObject):
    """Whatever bytes are changed, the archive is refused by name or unpacked inside its folder."""
    files = {"a/b.txt": b"0123456789" * 30, "c.txt": b"x" * 700}
    packed = pack(tmp_path / "take", files)
    whole = bytearray(packed.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    packed.write_bytes(whole)
    before = set(tmp_path.iterdir())
    with contextlib.suppress(InputError):
        assert unpack(packed).parent == scratch
    assert set(tmp_path.iterdir()) == before
