"""Folders that appear whole or not at all."""

from pathlib import Path

import pytest

from capture_app.staging import staged_folder
from omomo_core.errors import InputError


def make(target: Path, text: str, *, replace: bool = False) -> None:
    with staged_folder(target, replace=replace) as folder:
        assert not target.exists() or replace
        (folder / "manifest.json").write_text(text)


def test_the_folder_appears_with_everything_in_it(tmp_path: Path) -> None:
    target = tmp_path / "deep" / "result"
    make(target, "one")
    assert [p.name for p in target.parent.iterdir()] == ["result"]
    assert (target / "manifest.json").read_text() == "one"


def test_a_failure_leaves_nothing(tmp_path: Path) -> None:
    def interrupted() -> None:
        with staged_folder(tmp_path / "result") as folder:
            (folder / "half.npz").write_bytes(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not list(tmp_path.iterdir())


def test_an_earlier_result_is_kept_unless_asked(tmp_path: Path) -> None:
    target = tmp_path / "result"
    make(target, "one")
    with pytest.raises(InputError) as caught:
        make(target, "two")
    assert caught.value.code == "output-exists"
    assert "‹replace›" in caught.value.fix
    make(target, "two", replace=True)
    assert (target / "manifest.json").read_text() == "two"
    assert [p.name for p in tmp_path.iterdir()] == ["result"]


def test_a_failed_replacement_keeps_the_earlier_result(tmp_path: Path) -> None:
    target = tmp_path / "result"
    make(target, "one")
    with pytest.raises(ZeroDivisionError), staged_folder(target, replace=True):
        raise ZeroDivisionError
    assert (target / "manifest.json").read_text() == "one"
    assert [p.name for p in tmp_path.iterdir()] == ["result"]


@pytest.mark.parametrize("kind", ["folder", "file", "link"])
def test_force_never_replaces_what_is_no_result(tmp_path: Path, kind: str) -> None:
    target = tmp_path / "precious"
    if kind == "folder":
        target.mkdir()
        (target / "thesis.tex").write_text("years of work")
    elif kind == "file":
        target.write_text("years of work")
    else:
        make(tmp_path / "elsewhere", "one")
        target.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError) as caught:
        make(target, "two", replace=True)
    assert caught.value.code == "output-not-a-result"
    assert target.exists()


def test_a_name_taken_meanwhile_is_not_overwritten(tmp_path: Path) -> None:
    target = tmp_path / "result"

    def beaten() -> None:
        with staged_folder(target):
            target.mkdir()
            (target / "manifest.json").write_text("somebody else's")

    with pytest.raises(InputError) as caught:
        beaten()
    assert caught.value.code == "output-exists"
    assert [p.name for p in tmp_path.iterdir()] == ["result"]
    assert (target / "manifest.json").read_text() == "somebody else's"


def test_a_place_that_cannot_be_written_to_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError) as caught:
        make(tmp_path / "file" / "result", "one")
    assert caught.value.code == "output-not-writable"
