"""48 hostile archives, uploaded and reported on: each is refused by name and leaves nothing behind."""

import gzip
import io
import random
import struct
import tarfile
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.capture_app.web.talk import announce, problem
from tests.ingest.packing import pack_tar, pack_tar_gz, pack_zip

Make = Callable[[Path], object]
NAMES = {
    "parent": "../x",
    "parent inside": "a/../../x",
    "absolute": "/etc/cron.d/x",
    "drive": "C:/x",
    "drive relative": "c:x",
    "backslash": "a\\..\\x",
    "line break": "a\nb",
    "long part": "x" * 256,
    "long path": "ab/" * 400 + "x",
    "deep": "/".join("abcdefghijklmnopqrs"),
}
TWINS = {
    "case": ("a.txt", "A.TXT"),
    "folder case": ("x/b", "X/B"),
    "file and folder": ("a", "a/b"),
    "composed accents": ("Ger\u00e4t", "Gera\u0308t"),
}
PACKS = {"zip": pack_zip, "tar": pack_tar, "tar.gz": pack_tar_gz}


def _tar_member(kind: bytes) -> Make:
    def make(path: Path) -> None:
        with tarfile.open(path, "w") as packed:
            info = tarfile.TarInfo("odometry.csv")
            info.type, info.linkname = kind, "/etc/passwd"
            packed.addfile(info)

    return make


def _zip_mode(mode: int) -> Make:
    def make(path: Path) -> None:
        with zipfile.ZipFile(path, "w") as packed:
            info = zipfile.ZipInfo("odometry.csv")
            info.external_attr = mode << 16
            packed.writestr(info, "/etc/passwd")

    return make


def _patched(find: bytes, at: int, value: bytes) -> Make:
    """A zip with some bytes of its table of contents changed."""

    def make(path: Path) -> None:
        data = bytearray(pack_zip(path, {"a.txt": b"0123456789" * 100}).read_bytes())
        start = data.index(find) + at
        data[start : start + len(value)] = value
        path.write_bytes(data)

    return make


def _nul(path: Path) -> None:
    pack_zip(path, {"a.txt?.sh": b"x"})
    path.write_bytes(path.read_bytes().replace(b"a.txt?", b"a.txt\0"))


def _bomb(path: Path) -> None:
    pack_zip(path, {f"depth/{k}.png": bytes(40 * 2**20) for k in range(2)})


def _declared(size: int) -> Make:
    def make(path: Path) -> None:
        header = tarfile.TarInfo("rgb.mp4")
        header.size = size
        path.write_bytes(header.tobuf(tarfile.GNU_FORMAT))

    return make


def _claims(entries: int) -> Make:
    def make(path: Path) -> None:
        start = b"PK\3\4" + bytes(26)
        most = 0xFFFF, 0xFFFF, 0xFFFFFFFF, 0xFFFFFFFF
        zip64 = struct.pack(
            "<4sQ2H2L4Q", b"PK\6\6", 44, 45, 45, 0, 0, entries, entries, 0, len(start)
        )
        locator = struct.pack("<4sLQL", b"PK\6\7", 0, len(start), 1)
        path.write_bytes(
            start + zip64 + locator + struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, *most, 0)
        )

    return make


def _overlapping(path: Path) -> None:
    data = pack_zip(path, {"a" * 4: bytes(2**20)}).read_bytes()
    start, end = data.index(b"PK\1\2"), data.index(b"PK\5\6")
    table = b"".join(data[start:end].replace(b"aaaa", b"%04d" % k) for k in range(200))
    record = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 200, 200, len(table), start, 0)
    path.write_bytes(data[:start] + table + record)


def _cut(pack: Callable[..., Path]) -> Make:
    def make(path: Path) -> None:
        whole = pack(path, {"a.txt": random.Random(0).randbytes(3000)}).read_bytes()
        path.write_bytes(whole[:1500])

    return make


def _nested(path: Path) -> None:
    """An archive in an archive, five deep: it is listed, and its inside is no session."""
    data = b"pose"
    for _ in range(5):
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w") as packed:
            packed.writestr("inner.zip", data)
        data = buffer.getvalue()
    path.write_bytes(data)


HOSTILE: dict[str, Make] = {
    **{
        f"{word} in a {kind}": (
            lambda path, n=name, p=pack: p(path, {"odometry.csv": b"", n: b"x"})
        )
        for word, name in NAMES.items()
        for kind, pack in PACKS.items()
        if kind != "tar.gz" or word in ("parent", "absolute")
    },
    **{
        f"{word} twins in a {kind}": (lambda path, t=twins, p=pack: p(path, dict.fromkeys(t, b"x")))
        for word, twins in TWINS.items()
        for kind, pack in (("zip", pack_zip), ("tar", pack_tar))
    },
    **{f"{kind!r} in a tar": _tar_member(kind) for kind in (b"1", b"2", b"3", b"4")},
    "symbolic link in a zip": _zip_mode(0o120777),
    "device in a zip": _zip_mode(0o020666),
    "name with a NUL": _nul,
    "encrypted": _patched(b"PK\1\2", 8, b"\1"),
    "packed as nobody packs": _patched(b"PK\1\2", 10, b"\x0e\0"),
    "more than it says": _patched(b"PK\1\2", 24, struct.pack("<L", 10)),
    "less than it says": _patched(b"PK\1\2", 24, struct.pack("<L", 2000)),
    "bomb": _bomb,
    "10 GB declared": _declared(10 * 10**9),
    "8 exabytes declared": _declared(2**63 - 1),
    "a million entries": _claims(1_000_000),
    "entries that share bytes": _overlapping,
    "cut zip": _cut(pack_zip),
    "cut tar.gz": _cut(pack_tar_gz),
    "nested five deep": _nested,
    "gzip of text": lambda path: path.write_bytes(gzip.compress(b"t,x,y,z\n" * 1000)),
}
_EVERY = 6


def test_there_are_at_least_48_of_them():
    assert len(HOSTILE) >= 48


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if k % _EVERY == 0 else pytest.mark.slow)
        for k, name in enumerate(HOSTILE)
    ],
)
def test_it_is_refused_by_name_and_leaves_nothing(client, site, tmp_path: Path, name: str):
    packed = tmp_path / "take.zip"
    HOSTILE[name](packed)
    outside = set(site.library.root.parent.rglob("*")) - set(site.library.root.rglob("*"))
    id_ = announce(client, {"take.zip": packed.stat().st_size}, "session")["id"]
    client.put(f"/api/uploads/{id_}/files/0?offset=0", content=packed.read_bytes())
    finished = client.post(f"/api/uploads/{id_}/finish")
    if finished.status_code != 200:
        assert problem(finished, 422)["code"] == "session-unknown"
        assert list(site.library.scratch.iterdir()) == []
        assert client.delete(f"/api/uploads/{id_}").status_code == 204
        return
    report = client.get(f"/api/sessions/{id_}/report").json()
    assert report["verdict"] == "not usable"
    assert report["checks"] == []
    code = report["problem"]["code"]
    assert code.startswith("archive-"), report["problem"]
    assert report["problem"]["what"]
    assert report["problem"]["where"].startswith("take.zip")
    assert list(site.library.scratch.iterdir()) == []
    assert client.get(f"/api/sessions/{id_}").json()["size"] == packed.stat().st_size
    left = set(site.library.root.parent.rglob("*")) - set(site.library.root.rglob("*"))
    assert left == outside
    assert client.delete(f"/api/sessions/{id_}").status_code == 204
