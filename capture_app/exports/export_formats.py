"""The formats: their endings, and which axes and units each may have."""

from dataclasses import dataclass
from pathlib import Path

from capture_app.commands.export import Bones, ExportFormat, Units, UpAxis
from omomo_core.errors import InputError


@dataclass(frozen=True)
class FileLayout:
    """The choices that a format has; the first of several is the usual one."""

    endings: tuple[str, ...]
    ups: tuple[UpAxis, ...]
    units: tuple[Units, ...]
    says: bool = False
    """The file itself says its axes and its unit, so that every program reads it right."""


FORMATS: dict[ExportFormat, FileLayout] = {
    ExportFormat.glb: FileLayout((".glb", ".vrma"), ("y",), ("m",)),
    ExportFormat.bvh: FileLayout((".bvh",), ("y", "z"), ("cm", "m")),
    ExportFormat.usd: FileLayout(
        (".usdc", ".usda", ".usdz", ".usd"), ("z", "y"), ("m", "cm"), says=True
    ),
    ExportFormat.fbx: FileLayout((".fbx",), ("y", "z"), ("cm", "m")),
    ExportFormat.amass: FileLayout((".npz",), ("z",), ("m",)),
    ExportFormat.csv: FileLayout((".csv",), ("z", "y"), ("m", "cm")),
}
_HOME: dict[Bones, tuple[UpAxis, Units]] = {
    Bones.unreal: ("z", "cm"),
    Bones.unity: ("y", "m"),
    Bones.vrm: ("y", "m"),
}
"""Axes and unit of the programs themselves."""


def layout_of(kind: ExportFormat) -> FileLayout:
    """Return the layout of a format.

    Raises:
        InputError: "format-not-written" for COLLADA, "robot-is-folder" for a robot.
    """
    if kind in (ExportFormat.robot, ExportFormat.lerobot):
        raise InputError(
            "robot-is-folder",
            "A robot's motion is a folder of files, which only the command line writes.",
            where=f"‹to› {kind}",
            fix=f"Use ‹omocap export› with ‹to› {kind} and ‹robot›.",
        )
    if kind is ExportFormat.dae:
        raise InputError(
            "format-not-written",
            "COLLADA is not written: no maintained library writes its skins and animations, and "
            "Blender no longer reads it.",
            where="‹to› dae",
            fix="Export ‹to› glb, which the same programs read.",
        )
    return FORMATS[kind]


def format_of_ending(path: Path) -> ExportFormat:
    """The format that a file's ending says.

    Raises:
        InputError: "output-ending" when it is none of theirs.
    """
    for kind, form in FORMATS.items():
        if path.suffix.lower() in form.endings:
            return kind
    endings = ", ".join(ending for form in FORMATS.values() for ending in form.endings)
    raise InputError(
        "output-ending",
        "The ending of this output file is that of no format.",
        where=str(path),
        fix=f"Give a name that ends in one of {endings}.",
    )


def frame_of(
    kind: ExportFormat, bones: Bones, up: UpAxis | None, units: Units | None
) -> tuple[UpAxis, Units]:
    """UpAxis axis and units of a file: as asked for, or as those expect it who will read it.

    Raises:
        InputError: "frame-fixed" when the format does not leave the choice.
    """
    form = layout_of(kind)
    home_up, home_units = _HOME[bones] if form.says and bones in _HOME else (None, None)
    _allowed(kind, "‹up›", up, form.ups)
    _allowed(kind, "‹units›", units, form.units)
    return up or home_up or form.ups[0], units or home_units or form.units[0]


def _allowed(kind: ExportFormat, option: str, wanted: str | None, choices: tuple[str, ...]) -> None:
    if wanted is not None and wanted not in choices:
        raise InputError(
            "frame-fixed",
            f"A {kind} file has its axes and units by definition ({choices[0]}); the programs that "
            "read it convert by themselves.",
            where=f"{option} {wanted}",
            fix=f"Leave {option} out.",
        )


def target_of(output: Path, name: str, to: ExportFormat) -> Path:
    """Return the file to write.

    Args:
        output: what the user gave: a file, or a folder to put it in.
        name: of the file in that folder, without its ending.
        to: its format.

    Raises:
        InputError: "output-ending" when a file's ending is not one of the format's.
    """
    endings = layout_of(to).endings
    if output.is_dir():
        return output / f"{name}{endings[0]}"
    if output.suffix.lower() not in endings:
        raise InputError(
            "output-ending",
            f"This output file must end in {' or '.join(endings)}.",
            where=str(output),
            fix="Give another name with ‹output›.",
        )
    return output
