"""The printed sheet, measured by another program that reads PDF."""

from pathlib import Path

import numpy as np
import pypdfium2
import pytest

from ingest.calibration.board.board_detect import Detector
from ingest.calibration.board.board_sheet import PAPERS, preset_for, write_sheet
from ingest.calibration.board.board_spec import PRESETS, Board
from omomo_core.errors import InputError

DPI = 200
PX_PER_MM = DPI / 25.4


def raster(path: Path) -> np.ndarray:
    page = pypdfium2.PdfDocument(path)[0]
    return np.ascontiguousarray(page.render(scale=DPI / 72, grayscale=True).to_numpy().squeeze())


def measured(grey: np.ndarray, board: Board) -> np.ndarray:
    """Inner corners of the board on the page, millimetres from the page's corner."""
    found = Detector(board).find(grey)
    assert found.numbers.tolist() == list(range(len(board.corners)))
    return (found.pixels + 0.5) / PX_PER_MM


@pytest.mark.parametrize("paper", ["A4", "Letter", "A3", "Tabloid"])
def test_a_board_is_printed_at_true_size(tmp_path: Path, paper):
    board = preset_for(paper)
    write_sheet(board, paper, tmp_path / "board.pdf")
    grey = raster(tmp_path / "board.pdf")
    size = np.array(grey.shape)[::-1] / PX_PER_MM
    np.testing.assert_allclose(size, 1e3 * np.array(PAPERS[paper]), atol=0.2)
    at = measured(grey, board)
    np.testing.assert_allclose(
        at - at[0], 1e3 * (board.corners - board.corners[0])[:, :2], atol=0.1
    )


def test_rulers_are_as_long_as_they_say(tmp_path: Path):
    board = PRESETS["A4"]
    write_sheet(board, "A4", tmp_path / "board.pdf")
    grey = raster(tmp_path / "board.pdf")
    first = measured(grey, board)[0] - 1e3 * board.square
    # The long line of a ruler runs 4 mm beyond the board; its ticks point away from the board.
    beyond = first + 1e3 * np.array([board.width, board.height]) + 4.0
    row, column = (beyond[::-1] * PX_PER_MM).astype(int)
    for line in (grey[row - 1 : row + 2].min(axis=0), grey[:, column - 1 : column + 2].min(axis=1)):
        dark = np.flatnonzero(line < 200)
        longest = max(np.split(dark, np.flatnonzero(np.diff(dark) > 1) + 1), key=len)
        assert len(longest) / PX_PER_MM == pytest.approx(150.0, abs=0.3)


def test_the_sheet_says_how_to_print_it(tmp_path: Path):
    write_sheet(PRESETS["A4"], "a4", tmp_path / "board.pdf")
    text = pypdfium2.PdfDocument(tmp_path / "board.pdf")[0].get_textpage().get_text_range()
    for words in (str(PRESETS["A4"]), "100 %", "do not fit to page", "150 mm", "origin"):
        assert words in text


def test_the_same_board_is_the_same_file(tmp_path: Path):
    for name in ("a.pdf", "b.pdf"):
        write_sheet(PRESETS["A4"], "A4", tmp_path / name)
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()


def test_a_wide_board_lies_on_the_sheet(tmp_path: Path):
    board = Board(7, 5, 0.030, 0.022)
    write_sheet(board, "A4", tmp_path / "board.pdf")
    grey = raster(tmp_path / "board.pdf")
    assert grey.shape[1] > grey.shape[0]
    measured(grey, board)


def test_a_board_that_does_not_fit_says_what_does(tmp_path: Path):
    with pytest.raises(InputError) as error:
        write_sheet(PRESETS["A3"], "A4", tmp_path / "board.pdf")
    assert error.value.code == "board-too-large"
    largest = float(error.value.fix.split(" mm")[0].rsplit(" ", 1)[1])
    write_sheet(Board(5, 7, largest / 1e3, 0.7 * largest / 1e3), "A4", tmp_path / "board.pdf")
    larger = largest / 1e3 + 2e-4
    with pytest.raises(InputError):
        write_sheet(Board(5, 7, larger, 0.7 * larger), "A4", tmp_path / "board.pdf")


def test_an_unknown_paper_is_refused(tmp_path: Path):
    with pytest.raises(InputError, match="B5"):
        write_sheet(PRESETS["A4"], "B5", tmp_path / "board.pdf")
