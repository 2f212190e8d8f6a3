"""The extension for Blender as the one file that Blender installs."""

from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from omomo_core.errors import InputError
from omomo_core.whole_file import whole_file

_FOLDER = Path(__file__).parents[1] / "blender_extension"
_DATE = (2026, 1, 1, 0, 0, 0)
"""The same for every file: the same version gives the same bytes."""


def write_extension(path: Path) -> None:
    """Write the zip, in the layout of Blender's extensions (manifest schema 1.0.0).

    Args:
        path: the .zip file to write.

    Raises:
        InputError: "output-ending", or it cannot be written.
    """
    if path.suffix.lower() != ".zip":
        raise InputError(
            "output-ending",
            "Blender installs extensions from files that end in .zip.",
            where=str(path),
            fix="Give a name such as omocap.zip with ‹output›.",
        )
    sources = sorted(p for p in _FOLDER.iterdir() if p.suffix in (".py", ".toml"))
    with whole_file(path) as partial, ZipFile(partial, "w", ZIP_DEFLATED) as packed:
        for source in sources:
            packed.writestr(ZipInfo(source.name, _DATE), source.read_bytes(), ZIP_DEFLATED)
