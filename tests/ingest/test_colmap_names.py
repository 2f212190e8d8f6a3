"""Text models of COLMAP: comments, and pictures whose names hold blanks."""

from pathlib import Path

import pytest

from ingest.colmap import read_model
from omomo_core.errors import InputError

IMAGES = """# Image list with two lines of data per image:
1 1 0 0 0 0 0 0 1 my photo 1.jpg
10 20 1
2 1 0 0 0 1 0 0 1 left camera/my  photo 2.jpg

# as written by hand
3 1 0 0 0 1 0 0 1 plain.jpg
10 20 -1
"""


def _model(folder: Path) -> Path:
    (folder / "cameras.txt").write_text("# cameras\n1 PINHOLE 640 480 500 500 320 240\n")
    (folder / "points3D.txt").write_text("# none\n1 0 0 1 255 0 0 0.1 1 0\n")
    (folder / "images.txt").write_text(IMAGES)
    return folder


def test_names_with_blanks_are_whole(tmp_path: Path):
    """The name is the last field of a line (colmap.github.io/format.html)."""
    images = read_model(_model(tmp_path)).images
    names = {k: image.name for k, image in images.items()}
    assert names == {1: "my photo 1.jpg", 2: "left camera/my  photo 2.jpg", 3: "plain.jpg"}


def test_a_damaged_model_is_told_without_the_words_of_the_library(tmp_path: Path):
    folder = _model(tmp_path)
    (folder / "cameras.txt").write_text("1 PINHOLE 640\n")
    with pytest.raises(InputError) as caught:
        read_model(folder)
    assert caught.value.what == "This is no COLMAP model: its files are damaged."
