"""Texts for people tell the names that they gave, and not where the server keeps them."""

from pathlib import Path

import pytest

from capture_app.web.library import Library


@pytest.mark.parametrize(
    ("inside", "told"),
    [
        ("sessions/0123456789abcdef/files/take.zip/odometry.csv:21", "take.zip/odometry.csv:21"),
        ("objects/0123456789abcdef/files/chair.obj", "chair.obj"),
        ("results/0123456789abcdef/motion.npz", "motion.npz"),
        ("results/0123456789abcdef.exports/a.glb", "a.glb"),
        ("results/0123456789abcdef.contacts.json", "contacts.json"),
        ("sessions/0123456789abcdef", ""),
        ("jobs.sqlite", "jobs.sqlite"),
    ],
)
def test_paths_are_shortened_wherever_they_stand(tmp_path: Path, inside: str, told: str):
    library = Library(tmp_path / "my library")
    place = library.root / inside
    assert library.shown(str(place)) == told
    assert library.shown(f"'{place}' is damaged.") == f"'{told}' is damaged."
    assert library.shown("elsewhere/take.zip") == "elsewhere/take.zip"


def test_what_a_killed_server_left_is_swept(tmp_path: Path):
    library = Library(tmp_path)
    for left in ("sessions/.trash-00", "results/.trash-11"):
        (tmp_path / left / "files").mkdir(parents=True)
    (library.scratch / "half").mkdir()
    library.sweep(10.0)
    library.empty_scratch()
    assert not list(tmp_path.rglob(".trash*"))
    assert not list(library.scratch.iterdir())


def test_a_library_that_is_opened_again_holds_the_same(tmp_path: Path):
    first = Library(tmp_path)
    (first.shelves["session"].folder / "0123456789abcdef").mkdir()
    assert Library(tmp_path).holder(first.shelves["session"].folder / "0123456789abcdef" / "x") == (
        "0123456789abcdef"
    )
