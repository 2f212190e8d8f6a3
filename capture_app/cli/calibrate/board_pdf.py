"""`omocap calibrate board-pdf`: a board to print at true size, or to show on a screen."""

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from capture_app.cli.console import output


def board_pdf(
    path: Annotated[
        Path,
        typer.Option(
            "-o", "--output", help="PDF to write (PNG with --screen).", show_default=False
        ),
    ],
    paper: Annotated[str, typer.Option(help="A4, A3, Letter or Tabloid.")] = "A4",
    board: Annotated[
        str,
        typer.Option(
            help="Columns x rows : square : marker : dictionary, such as "
            "5x7:35mm:26mm:DICT_5X5_100. The paper's own board if not given.",
            show_default=False,
        ),
    ] = "",
    screen: Annotated[
        str,
        typer.Option(
            help="Pixels of a screen to show the board on instead, such as 1170x2532.",
            show_default=False,
        ),
    ] = "",
    ppi: Annotated[
        float, typer.Option(help="Pixels per inch of that screen.", show_default=False)
    ] = 0.0,
) -> None:
    """Write the board that is fixed on the object, for `omocap calibrate board`.

    Print it at 100 % ("actual size"), measure both rulers, and glue it on something flat and stiff.
    """
    from ingest.calibration.board.board_sheet import preset_for, write_sheet
    from ingest.calibration.board.board_spec import parse_board
    from omomo_core.errors import InputError

    suffix = ".png" if screen else ".pdf"
    if path.suffix.lower() != suffix:
        raise InputError(
            "board-output",
            f"The board is a {suffix[1:].upper()} file.",
            where=str(path),
            fix=f"End its name with {suffix}.",
        )
    if not path.absolute().parent.is_dir():
        raise InputError(
            "output-folder",
            "The folder is not there.",
            where=str(path.parent),
            fix="Make it, or name another place with -o.",
        )
    chosen = parse_board(board) if board else preset_for(paper)
    if screen:
        from ingest.calibration.board.board_spec import write_screen

        write_screen(chosen, screen, ppi, path)
        output.print("Show it full screen at 100 %, without scaling, bright, with no bars over it.")
    else:
        write_sheet(chosen, paper, path)
        output.print("Print it at 100 % (actual size), then measure both rulers.")
    output.print(f"Board: {chosen}\nWritten: {escape(str(path))}", soft_wrap=True)
