"""`omocap calibrate board-pdf`: what it writes is the board it names."""

from pathlib import Path

import cv2
import numpy as np
import pypdfium2
import pytest
import typer
from typer.testing import CliRunner, Result

from capture_app.cli.calibrate import board_pdf
from ingest.calibration.board.board_detect import Detector
from ingest.calibration.board.board_spec import PRESETS, parse_board
from omomo_core.errors import InputError

app = typer.Typer()
app.command()(board_pdf)


def run(*arguments: str | Path) -> Result:
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.mark.runs("calibrate board-pdf")
def test_it_prints_the_papers_own_board(tmp_path: Path):
    result = run("-o", tmp_path / "board.pdf", "--paper", "letter")
    assert result.exit_code == 0
    assert str(PRESETS["Letter"]) in result.output
    assert "100 %" in result.output
    page = pypdfium2.PdfDocument(tmp_path / "board.pdf")[0]
    assert page.get_size() == pytest.approx((612.0, 792.0))
    grey = np.ascontiguousarray(page.render(scale=2, grayscale=True).to_numpy().squeeze())
    assert len(Detector(PRESETS["Letter"]).find(grey).numbers) == 24


def test_it_prints_a_board_of_ones_own(tmp_path: Path):
    text = "4x6:30mm:20mm:DICT_4X4_50"
    assert text in run("-o", tmp_path / "board.pdf", "--board", text).output


def test_a_screen_gets_a_picture_of_its_pixels(tmp_path: Path):
    text = "5x9:12mm:9mm:DICT_4X4_50"
    run("-o", tmp_path / "board.png", "--board", text, "--screen", "1170x2532", "--ppi", "460")
    grey = np.asarray(cv2.imread(str(tmp_path / "board.png"), cv2.IMREAD_GRAYSCALE))
    assert grey.shape == (2532, 1170)
    found = Detector(parse_board(text)).find(grey)
    side = found.pixels[1, 0] - found.pixels[0, 0]
    assert side == pytest.approx(12 * 460 / 25.4, abs=0.5)


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["-o", "board.png"], "board-output"),
        (["-o", "board.pdf", "--screen", "100x100", "--ppi", "460"], "board-output"),
        (["-o", "nowhere/board.pdf"], "output-folder"),
        (["-o", "board.pdf", "--paper", "A9"], "paper-unknown"),
        (["-o", "board.pdf", "--board", "A3"], "board-too-large"),
        (["-o", "board.png", "--screen", "1170x2532"], "screen-ppi"),
        (["-o", "board.png", "--screen", "big", "--ppi", "460"], "screen-pixels"),
        (["-o", "board.png", "--screen", "1170x2532", "--ppi", "460"], "board-too-large"),
    ],
)
def test_what_cannot_be_done_is_said(tmp_path: Path, monkeypatch, arguments, code):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as error:
        run(*arguments)
    assert error.value.code == code
    assert not list(tmp_path.iterdir())
