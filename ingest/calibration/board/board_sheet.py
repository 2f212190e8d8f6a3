"""A printable sheet with a board at true size, and rulers that show whether the printer kept it."""

from pathlib import Path

import numpy as np
from jaxtyping import Float64
from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas
from reportlab.pdfgen.pathobject import PDFPathObject

from ingest.calibration.board.board_spec import PRESETS, Board, pattern
from omomo_core.errors import InputError

PAPERS = {
    "A4": (0.210, 0.297),
    "A3": (0.297, 0.420),
    "Letter": (0.2159, 0.2794),
    "Tabloid": (0.2794, 0.4318),
}
"""Width and height upright, metres."""
_EDGE = 0.006
"""What printers leave white."""
_BEFORE = (_EDGE + 0.008, _EDGE + 0.022)
"""Left of the board (arrow) and above it (text, arrow)."""
_AFTER = (_EDGE + 0.012, _EDGE + 0.012)
"""Right of the board and below it (rulers)."""
_RULERS = (0.150, 0.100, 0.050)
_FONT, _SIZE = "Helvetica", 8.0
_LIGHT = 0.45


def preset_for(paper: str) -> Board:
    """The board that fills a sheet of this paper; of the next smaller one where there is none."""
    name, size = _size_of(paper)
    fitting = [b for p, b in PRESETS.items() if PAPERS[p][0] <= size[0] and PAPERS[p][1] <= size[1]]
    return PRESETS.get(name) or max(fitting, key=lambda board: board.square)


def write_sheet(board: Board, paper: str, path: Path) -> None:
    """Write a PDF of one page, which must be printed at 100 %.

    It holds the board, a ruler along each side, arrows from the board's origin along x and y, and
    the text that names the board. The sheet is upright, or lies where only that fits.

    Args:
        board: what to print.
        paper: a key of `PAPERS`, in any case.
        path: of the PDF; an older one is replaced.

    Raises:
        InputError: "paper-unknown", or "board-too-large" with the largest square that fits.
    """
    name, page = _paper(board, paper)
    canvas = Canvas(str(path), (1e3 * page[0] * mm, 1e3 * page[1] * mm), invariant=1)
    canvas.setTitle(f"ChArUco board {board}")
    canvas.setCreator("omocap")
    # From here on: metres from the top left corner of the page, y down, as in the board's frame.
    canvas.translate(0, 1e3 * page[1] * mm)
    canvas.scale(1e3 * mm, -1e3 * mm)
    _text(canvas, board, name)
    canvas.translate(*_start(board, page))
    _board(canvas, board)
    _axes(canvas, board)
    _rulers(canvas, board)
    canvas.showPage()
    canvas.save()


def _paper(board: Board, paper: str) -> tuple[str, tuple[float, float]]:
    """The paper's name, and its width and height the way the board fits on it."""
    name, upright = _size_of(paper)
    sizes = (upright, (upright[1], upright[0]))
    largest = [_largest_square(board, size) for size in sizes]
    best = 0 if largest[0] >= board.square - 1e-9 else int(np.argmax(largest))
    if largest[best] < board.square - 1e-9:
        # Rounded down, so that what is advised fits.
        fits = np.floor(1e4 * largest[best]) / 10
        raise InputError(
            "board-too-large",
            f"The board measures {1e3 * board.width:.0f} x {1e3 * board.height:.0f} mm, which "
            f"with its rulers does not fit on {name}.",
            where=str(board),
            fix=f"The largest square that fits is {fits:g} mm; or take larger paper.",
        )
    return name, sizes[best]


def _size_of(paper: str) -> tuple[str, tuple[float, float]]:
    """The paper's proper name, and its width and height upright."""
    names = {name.lower(): name for name in PAPERS}
    if paper.lower() not in names:
        raise InputError(
            "paper-unknown",
            f"There is no paper '{paper}'.",
            fix=f"Choose one of {', '.join(PAPERS)}.",
        )
    name = names[paper.lower()]
    return name, PAPERS[name]


def _largest_square(board: Board, page: tuple[float, float]) -> float:
    """Side of a square, metres, with which the board fills the page."""
    across, down = (page[i] - _BEFORE[i] - _AFTER[i] for i in (0, 1))
    return min(across / board.columns, down / board.rows)


def _start(board: Board, page: tuple[float, float]) -> tuple[float, float]:
    """Return the board's origin on the page; the rest of the page is shared by both margins."""
    free = [page[i] - _BEFORE[i] - _AFTER[i] - size for i, size in enumerate(_size(board))]
    return _BEFORE[0] + free[0] / 2, _BEFORE[1] + free[1] / 2


def _size(board: Board) -> tuple[float, float]:
    return board.width, board.height


def _board(canvas: Canvas, board: Board) -> None:
    drawn = pattern(board)
    # One path for each colour: neighbours within a path show no seam between them.
    for grey, rectangles in ((0.0, drawn.black), (1.0, drawn.white)):
        canvas.setFillGray(grey)
        canvas.drawPath(_path(canvas, rectangles), stroke=0, fill=1)


def _path(canvas: Canvas, rectangles: Float64[np.ndarray, "n 4"]) -> PDFPathObject:
    path = canvas.beginPath()
    for x, y, width, height in rectangles:
        path.rect(float(x), float(y), float(width), float(height))
    return path


def _text(canvas: Canvas, board: Board, paper: str) -> None:
    lines = (
        f"omocap board  {board}",
        f"Print on {paper} at 100 % (actual size); do not fit to page. Then measure both rulers.",
        "Glue it on something flat and stiff. The origin is where the arrows start; "
        "z points into the paper.",
    )
    for k, line in enumerate(lines):
        _write(canvas, _EDGE + 0.002, _EDGE + 0.004 * (k + 1), line, grey=0.0)


def _axes(canvas: Canvas, board: Board) -> None:
    """Arrows along x and y, beside the board so that nothing disturbs its squares."""
    away, length, head = 0.004, 0.025, 0.0012
    canvas.setLineWidth(0.0003)
    for name, turned in (("x", False), ("y", True)):
        canvas.saveState()
        if turned:  # swaps x and y
            canvas.transform(0, 1, 1, 0, 0, 0)
        canvas.setStrokeGray(0.0)
        canvas.line(0, -away, length, -away)
        canvas.line(0, -away - head, 0, -away + head)
        for side in (-head, head):
            canvas.line(length, -away, length - 2 * head, -away + side)
        canvas.restoreState()
        at = (-away - 0.001, length + 0.004) if turned else (length + 0.0015, -away + 0.001)
        _write(canvas, *at, name, grey=0.0)
    _write(canvas, -0.0075, -away - 0.002, "origin", grey=0.0, size=6.0)


def _rulers(canvas: Canvas, board: Board) -> None:
    """Below the board and right of it, a line every millimetre; as long as the board allows."""
    for turned, (along, across) in ((False, _size(board)), (True, _size(board)[::-1])):
        length = next((r for r in _RULERS if r <= along), 0.01 * int(along / 0.01))
        canvas.saveState()
        if turned:
            canvas.transform(0, 1, 1, 0, 0, 0)
        canvas.setLineWidth(0.00015)
        canvas.setStrokeGray(0.0)
        base = across + 0.004
        canvas.line(0, base, length, base)
        for k in range(round(1000 * length) + 1):
            tick = 0.004 if k % 10 == 0 else 0.003 if k % 5 == 0 else 0.002
            canvas.line(0.001 * k, base, 0.001 * k, base + tick)
        canvas.restoreState()
        label = f"{1e3 * length:.0f} mm"
        at = (base + 0.0005, length + 0.004) if turned else (length + 0.002, base + 0.003)
        _write(canvas, *at, label, grey=_LIGHT)


def _write(
    canvas: Canvas, x: float, y: float, text: str, *, grey: float, size: float = _SIZE
) -> None:
    """A line of text whose baseline starts at x, y; the page is drawn upside down."""
    canvas.saveState()
    canvas.translate(x, y)
    canvas.scale(0.001 / mm, -0.001 / mm)
    canvas.setFillGray(grey)
    canvas.setFont(_FONT, size)
    canvas.drawString(0, 0, text)
    canvas.restoreState()
