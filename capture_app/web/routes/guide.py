"""What guides a person through a calibration: what to do, what to print, a look at what was recorded."""

from typing import Annotated, Any

from fastapi import APIRouter, Query
from fastapi.responses import FileResponse
from pydantic import BaseModel

from capture_app.commands.inputs import ShortText
from capture_app.web.cache import key
from capture_app.web.file_response import file_response
from capture_app.web.library.ids import Id
from capture_app.web.page_words import all_in_page_words
from capture_app.web.sandbox import drawing, looks
from capture_app.web.site import Here
from ingest.calibration.board.board_sheet import PAPERS
from ingest.calibration.board.board_spec import PRESETS

router = APIRouter(prefix="/api/calibration", tags=["calibration"])
_PDF: dict[int | str, dict[str, Any]] = {200: {"content": {"application/octet-stream": {}}}}


class Looked(BaseModel):
    """What a look at a recording showed."""

    good: str
    doubts: list[str]
    notes: list[str]


@router.get("")
def ways() -> dict[str, Any]:
    """What each way needs and what to do for it, step by step; and the boards there are to print."""
    from capture_app.calibration.guide_flow import RECIPES

    return {
        "ways": {
            recipe.key: {
                "have": recipe.have,
                "steps": {step.title: step.do for step in recipe.steps if step.do},
            }
            for recipe in RECIPES
        },
        "papers": list(PAPERS),
        "boards": {
            name: {
                "text": str(board),
                "width_mm": round(1e3 * board.width, 3),
                "height_mm": round(1e3 * board.height, 3),
            }
            for name, board in PRESETS.items()
        },
    }


@router.get("/look")
async def look(site: Here, of: looks.Look, id: Id, board: ShortText = "") -> Looked:
    """A quick look at a recording, a film or a log, by what it is to be used for."""
    path = site.library.content(id, "session", "video", "material")
    looked = await site.sandbox.run(looks.look, path, of, board)
    return Looked.model_validate(all_in_page_words(looked, "calibrate"))


@router.get("/board.pdf", response_class=FileResponse, responses=_PDF)
async def board_sheet(
    site: Here, paper: Annotated[str, Query(max_length=40)] = "A4"
) -> FileResponse:
    """The board to print at 100 %."""
    path = site.library.cache / f"board-{key('board', paper)}.pdf"
    if not path.is_file():
        await site.sandbox.run(drawing.board_sheet, paper, path)
    return file_response(path, "board.pdf")
