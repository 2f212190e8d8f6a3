"""Whether a file can be written, before anything slow starts."""

from pathlib import Path

from omomo_core.errors import InputError


def check_target(file: Path, endings: tuple[str, ...]) -> None:
    """Refuse a file of another kind, in no folder, or that is a folder.

    Raises:
        InputError: "output-ending", "output-not-writable" or "output-is-folder".
    """
    if file.is_dir():
        raise InputError(
            "output-is-folder",
            "The output file is a folder.",
            where=str(file),
            fix=f"Give the name of a file that ends in {' or '.join(endings)} with -o.",
        )
    if not file.name.endswith(endings):
        raise InputError(
            "output-ending",
            f"This output file must end in {' or '.join(endings)}.",
            where=str(file),
            fix="Give another name with -o.",
        )
    if not file.parent.is_dir():
        raise InputError(
            "output-not-writable",
            "The folder for the output file does not exist.",
            where=str(file.parent),
            fix="Make it, or give another file with -o.",
        )
