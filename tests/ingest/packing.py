"""Archives for tests, and the refusal of one."""

import io
import tarfile
import tempfile
import time
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from ingest.formats.registry import read_session
from omomo_core.errors import InputError

Pack = Callable[[Path, dict[str, bytes]], Path]


def unpack_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A fixture: where archives are unpacked in a test."""
    folder = tmp_path / "scratch"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def pack_zip(path: Path, files: dict[str, bytes]) -> Path:
    with warnings.catch_warnings(), zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        warnings.simplefilter("ignore", UserWarning)  # A name given twice is the point of a test.
        for name, data in files.items():
            # ZipInfo itself would cut a name at a NUL.
            info = zipfile.ZipInfo("x")
            info.filename = name.partition("#")[0]
            packed.writestr(info, data, zipfile.ZIP_DEFLATED)
    return path


def pack_tar(path: Path, files: dict[str, bytes], mode: str = "w") -> Path:
    with tarfile.open(path, mode) as packed:
        for name, data in files.items():
            info = tarfile.TarInfo(name.partition("#")[0])
            info.size = len(data)
            packed.addfile(info, io.BytesIO(data))
    return path


def pack_tar_gz(path: Path, files: dict[str, bytes]) -> Path:
    return pack_tar(path, files, "w:gz")


every_pack = pytest.mark.parametrize("pack", [pack_zip, pack_tar, pack_tar_gz])


def files_in(folder: Path) -> dict[str, bytes]:
    return {str(f.relative_to(folder)): f.read_bytes() for f in folder.rglob("*") if f.is_file()}


def refused(path: Path, scratch: Path) -> InputError:
    """The refusal, after at most a second; nothing is left of the archive."""
    started = time.process_time()
    with pytest.raises(InputError) as caught:
        read_session(path)
    assert time.process_time() - started < 1
    assert list(scratch.iterdir()) == []
    assert caught.value.where == str(path)
    assert caught.value.fix
    return caught.value
