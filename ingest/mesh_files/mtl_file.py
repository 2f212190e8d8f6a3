"""read_materials: the colours and pictures of the material libraries beside an OBJ file."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path

from PIL import Image

from ingest.mesh_texture import BaseColour

_MOST_BYTES, _MOST_PICTURE = 10 * 10**6, 500 * 10**6
_VECTORS = {"-s": 3, "-o": 3, "-t": 3, "-mm": 2}
"""Options of pictures that take up to so many numbers; all others take one word."""
_SINGLE = ("-blendu", "-blendv", "-cc", "-clamp", "-boost", "-bm", "-imfchan", "-texres", "-type")


@dataclass(frozen=True)
class Material:
    """What a material says of the base colour."""

    colour: tuple[float, float, float] | None = None
    """sRGB, 0 to 255; None where it states none."""
    picture: BaseColour | None = None
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    """What is done to texture coordinates, before they are flipped."""


def read_materials(
    obj: Path, libraries: Sequence[str]
) -> tuple[dict[str, Material], tuple[str, ...]]:
    """Read all materials by their names; what is not there or damaged is left out.

    Args:
        obj: the OBJ file, in whose folder all lies.
        libraries: what follows its words mtllib; several names, or one with blanks.

    Returns:
        The materials, and notes about pictures that could not be read.
    """
    materials: dict[str, Material] = {}
    lost: list[str] = []
    opened: dict[str, BaseColour | None] = {}
    for said in libraries:
        files = list(_files(obj, said))
        if not files:
            lost.append(f"its materials left out: {said[:60]} is not beside it")
        for file in files:
            for line in file.read_text("utf-8", "replace").splitlines():
                _statement(line.partition("#")[0].split(), materials, obj.parent, opened)
    lost += [
        f"the picture {name} cannot be read" for name, found in opened.items() if found is None
    ]
    return materials, tuple(lost)


def _files(obj: Path, said: str) -> Iterator[Path]:
    whole = inside(obj.parent, said)
    names = [said] if whole is not None else said.split()
    for name in names:
        file = inside(obj.parent, name)
        if file is not None and file.stat().st_size <= _MOST_BYTES:
            yield file


def inside(folder: Path, name: str) -> Path | None:
    """The file of this name in a folder, in any case of its letters; None where it is not there."""
    name = name.strip().strip('"').replace("\\", "/")
    try:
        for said in (name, name.rsplit("/", 1)[-1]):
            file = folder / said
            if said and file.is_file() and file.resolve().is_relative_to(folder.resolve()):
                return file
        last = name.rsplit("/", 1)[-1].lower()
        return next((f for f in folder.iterdir() if f.name.lower() == last and f.is_file()), None)
    except (OSError, ValueError):  # a name that no file can have
        return None


def _statement(
    words: list[str],
    materials: dict[str, Material],
    folder: Path,
    opened: dict[str, BaseColour | None],
) -> None:
    """Add what a line says about the last material to it."""
    if len(words) < 2:
        return
    key, last = words[0].lower(), next(reversed(materials), None)
    if key == "newmtl":
        materials[" ".join(words[1:])] = Material()
    elif last is not None and key == "kd":
        materials[last] = replace(materials[last], colour=_colour(words[1:]))
    elif last is not None and key == "map_kd":
        name, scale, offset = _options(words[1:])
        if name not in opened:
            opened[name] = picture_inside(folder, name)
        materials[last] = replace(materials[last], picture=opened[name], scale=scale, offset=offset)


def _colour(words: list[str]) -> tuple[float, float, float] | None:
    try:
        values = [255 * float(word) for word in words[:3]]
    except ValueError:
        return None
    red, green, blue = values * 3 if len(values) == 1 else [*values, 0.0, 0.0][:3]
    return (red, green, blue)


def _options(words: list[str]) -> tuple[str, tuple[float, float], tuple[float, float]]:
    """A picture's name, which may have blanks, and its scale and offset."""
    found: dict[str, tuple[float, float]] = {}
    while len(words) > 1 and (words[0] in _VECTORS or words[0] in _SINGLE):
        option, words = words[0], words[1:]
        most, values = _VECTORS.get(option, 0), list[float]()
        while len(words) > 1 and len(values) < most and _number(words[0]) is not None:
            values.append(_number(words[0]) or 0.0)
            words = words[1:]
        if option in _SINGLE:
            words = words[1:]
        elif values:
            default = 1.0 if option == "-s" else 0.0
            found[option] = (values[0], values[1] if len(values) > 1 else default)
    return " ".join(words), found.get("-s", (1.0, 1.0)), found.get("-o", (0.0, 0.0))


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None


def picture_inside(folder: Path, name: str) -> BaseColour | None:
    """The picture of this name in a folder; None where it is not there, or is none."""
    file = inside(folder, name)
    try:
        if file is None or file.stat().st_size > _MOST_PICTURE:
            return None
        return BaseColour(Image.open(BytesIO(file.read_bytes())))
    except Exception:  # Pillow raises anything on a damaged picture
        return None
