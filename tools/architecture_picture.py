"""Draw docs/pictures/architecture.webp: the way of a take through the packages.

    python tools/architecture_picture.py docs/pictures/architecture.webp

Each row is a package, each box a value with its type and, below it, the module that makes it.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

SIZE = (1500, 840)
INK, PALE, LINE = (28, 34, 43), (92, 102, 115), (120, 130, 143)
BOX = (240, 86)
LEFT, GAP = 60, 46


@dataclass(frozen=True)
class PackageRow:
    """A package, drawn as a coloured stripe with its boxes from left to right."""

    name: str
    colour: tuple[int, int, int]
    top: int
    bottom: int
    boxes: tuple[tuple[str, str], ...]
    """What each box says: the value, and the module that makes it."""

    def at(self, number: int) -> tuple[int, int]:
        """Upper left corner of a box, in pixels."""
        return LEFT + number * (BOX[0] + GAP), self.bottom - BOX[1] - 26


ROWS = (
    PackageRow("what you give", (243, 244, 246), 20, 190, (
        ("session folder", "the phone's log"),
        ("mesh", "OBJ, PLY, STL, GLB"),
        ("mount.json", "omocap calibrate"),
    )),
    PackageRow("ingest", (224, 238, 250), 206, 380, (
        ("CaptureSession", "ingest.formats"),
        ("ObjectMesh", "ingest.mesh"),
        ("Mount", "ingest.mount_file"),
        ("ObjectMotion", "ingest.trajectory"),
    )),
    PackageRow("omomo_core", (227, 244, 228), 396, 572, (
        ("palms, stage 1", "stages.hands_capture"),
        ("contact segments", "contact"),
        ("body, stage 2", "stages.body_capture"),
        ("solved bodies", "generation.solving"),
        ("K ranked samples", "generation.selection"),
    )),
    PackageRow("capture_app", (252, 236, 220), 588, 820, (
        ("motion.npz", "capture_app.result"),
        ("contacts.json", "omomo_core.contact"),
        ("motion.glb", "capture_app.exports"),
        ("motion.mp4", "render"),
        ("manifest.json", "capture_app.manifest"),
    )),
)  # fmt: skip


def draw(path: Path) -> None:
    """Write the picture; the suffix of the path decides its format."""
    image = Image.new("RGB", SIZE, (255, 255, 255))
    pen = ImageDraw.Draw(image)
    for row in ROWS:
        pen.rounded_rectangle((20, row.top, SIZE[0] - 20, row.bottom), 16, fill=row.colour)
        pen.text((LEFT, row.top + 14), row.name, INK, _font(26))
        for number, texts in enumerate(row.boxes):
            _box(pen, row.at(number), texts)
    _result_folder(pen)
    _arrows(pen)
    image.save(path, **({"lossless": True} if path.suffix == ".webp" else {}))


def _box(pen: ImageDraw.ImageDraw, corner: tuple[int, int], texts: tuple[str, str]) -> None:
    x, y = corner
    pen.rounded_rectangle((x, y, x + BOX[0], y + BOX[1]), 10, (255, 255, 255), LINE, 2)
    for text, size, colour, below in ((texts[0], 24, INK, 28), (texts[1], 20, PALE, 60)):
        pen.text((x + BOX[0] / 2, y + below), text, colour, _font(size), anchor="mm")


def _result_folder(pen: ImageDraw.ImageDraw) -> None:
    """A frame around the files of a result, and who uses them."""
    row = ROWS[-1]
    x, y = row.at(0)
    right = row.at(4)[0] + BOX[0]
    pen.rounded_rectangle((x - 16, y - 46, right + 16, y + BOX[1] + 14), 12, None, LINE, 2)
    pen.text((x, y - 24), "result folder", INK, _font(22), anchor="lm")
    users = "one function, capture_app.pipeline.run_take, for command line, page, batch and Python"
    pen.text((LEFT + 190, row.top + 18), users, PALE, _font(20))


def _arrows(pen: ImageDraw.ImageDraw) -> None:
    given, ingest, core, app = ROWS
    for number in range(3):
        _down(pen, given, number, ingest, number)
    for row, count in ((ingest, 3), (core, 4)):
        for number in range(2 if row is ingest else 0, count):
            x, y = row.at(number)
            start = (x + BOX[0] + 4, y + BOX[1] // 2)
            _arrow(pen, (start, (start[0] + GAP - 8, start[1])))
    last, y = ingest.at(3)[0] + BOX[0] // 2, ingest.at(3)[1] + BOX[1]
    for number in range(2):  # The session and the mesh reach the motion from below.
        x = ingest.at(number)[0] + BOX[0] // 2
        pen.line(((x, y + 2), (x, y + 12), (last - 40, y + 12)), LINE, 3)
    _arrow(pen, ((last - 40, y + 12), (last - 40, y + 2)))
    middle = (y + core.top) // 2 + 8
    x = core.at(0)[0] + BOX[0] - 30
    pen.line(((last, y + 2), (last, middle), (x, middle)), LINE, 3)
    _arrow(pen, ((x, middle), (x, core.at(0)[1] - 4)))
    x = core.at(4)[0] + BOX[0] // 2
    _arrow(pen, ((x, core.at(4)[1] + BOX[1] + 2), (x, app.at(4)[1] - 50)))


def _down(
    pen: ImageDraw.ImageDraw, upper: PackageRow, start: int, lower: PackageRow, end: int
) -> None:
    x, y = upper.at(start)
    to = lower.at(end)
    _arrow(pen, ((x + BOX[0] // 2, y + BOX[1] + 2), (to[0] + BOX[0] // 2, to[1] - 4)))


def _arrow(pen: ImageDraw.ImageDraw, ends: tuple[tuple[int, int], tuple[int, int]]) -> None:
    """A line with a head at its second end; level or upright."""
    (x0, y0), (x, y) = ends
    pen.line(ends, LINE, 3)
    dx, dy = (x > x0) - (x < x0), (y > y0) - (y < y0)
    base = (x - 12 * dx, y - 12 * dy)
    sides = ((base[0] - 7 * dy, base[1] - 7 * dx), (base[0] + 7 * dy, base[1] + 7 * dx))
    pen.polygon(((x, y), *sides), LINE)


def _font(size: int) -> ImageFont.ImageFont | ImageFont.FreeTypeFont:
    return ImageFont.load_default(size)


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
