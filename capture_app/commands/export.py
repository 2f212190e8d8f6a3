"""ExportRequest: what can be said about a result that is to become a file of another program."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from capture_app.commands.inputs import FromLibrary, Sample, shown
from capture_app.commands.request import Request
from omomo_core.errors import InputError

UpAxis = Literal["y", "z"]
Units = Literal["m", "cm"]


class ExportFormat(StrEnum):
    """What to write; robot and lerobot are folders, and dae is there to be refused with a reason."""

    glb = "glb"
    bvh = "bvh"
    usd = "usd"
    fbx = "fbx"
    amass = "amass"
    csv = "csv"
    robot = "robot"
    lerobot = "lerobot"
    dae = "dae"


class Bones(StrEnum):
    """Program whose names the bones get."""

    smplx = "smplx"
    mixamo = "mixamo"
    unreal = "unreal"
    unity = "unity"
    vrm = "vrm"


def _number(value: object) -> object:
    return int(value) if isinstance(value, str) and value.isdecimal() else value


FORMAT_WORDS = shown(
    words="glb: GLB for Blender, Unity, Unreal; bvh: BVH for any animation program; "
    "usd: USD for Maya, Houdini, Unreal; fbx: FBX through your Blender; "
    "amass: npz of SMPL-X, for research; csv: CSV for spreadsheets"
)


class ExportOptions(BaseModel):
    """How the file shall be; None leaves it to the format."""

    model_config = ConfigDict(extra="forbid")

    to: Annotated[
        ExportFormat | None,
        FORMAT_WORDS,
        Field(title="Format", description="Format; that of the output file's ending if not given."),
    ] = None
    fps: Annotated[
        Literal[24, 25, 30, 50, 60],
        BeforeValidator(_number),
        Field(title="Frames a second", description="Frames a second."),
    ] = 30
    up: Annotated[
        UpAxis | None,
        shown(words=": as usual there; y: y; z: z"),
        Field(
            title="Up axis",
            description="Up axis; what the format's readers expect if not given.",
        ),
    ] = None
    units: Annotated[
        Units | None,
        shown(words=": as usual there; m: metres; cm: centimetres"),
        Field(
            title="Unit of lengths",
            description="Unit; what the format's readers expect if not given.",
        ),
    ] = None
    bones: Annotated[
        Bones,
        shown(words="smplx: SMPL-X; mixamo: Mixamo; unreal: Unreal; unity: Unity; vrm: VRM"),
        Field(title="Names of the bones", description="Program whose names the bones shall have."),
    ] = Bones.smplx
    sample: Sample = None


class ExportRequest(ExportOptions, Request):
    """A sample of a result becomes a file of another program.

    The output is the file, or a folder for it.
    """

    KIND: ClassVar[str] = "export"
    READS: ClassVar[tuple[str, ...]] = ("result", "skeleton", "robot", "frames")

    result: Path
    skeleton: Annotated[
        Path | None,
        FromLibrary(
            ("material",),
            (
                "Drop your own character here",
                "GLB, VRM or BVH, at rest in a T- or A-pose. The motion is made for it: palms stay in place.",
            ),
            ".glb,.vrm,.bvh",
        ),
        Field(
            title="Your own character",
            description="Character to move instead of ours: BVH, GLB, VRM or FBX with bones named as "
            "Mixamo, Unreal, Unity, VRM, Rigify or DAZ does, or a SMPL-X model file.",
        ),
    ] = None
    blender: Annotated[
        str | None,
        Field(description="Blender that writes and reads FBX, if it is not on the PATH."),
    ] = None
    robot: Annotated[
        Path | None,
        Field(
            description="Robot that shall do the motion: its MJCF or URDF file (with --to robot or lerobot)."
        ),
    ] = None
    frames: Annotated[
        Path | None,
        Field(description="File that maps the robot's bodies, if it is not a Unitree G1 or H1."),
    ] = None
    all_samples: Annotated[
        bool,
        Field(description="An episode for each sample, not for the chosen one alone (lerobot)."),
    ] = False
    task: Annotated[
        str | None,
        Field(
            min_length=1,
            max_length=200,
            description="What the robot does, in words (lerobot); made from the object's name if not given.",
        ),
    ] = None
    reduce_keys: Annotated[
        float | None,
        shown(unit="mm"),
        Field(
            title="Fewer keys",
            gt=0.0,
            le=100.0,
            description="Leave out keys of a GLB while no joint is further than this from where it was, mm; "
            "a key in every frame if not given.",
        ),
    ] = None

    @property
    def is_of_robot(self) -> bool:
        """Whether a robot's folder is asked for."""
        return (
            self.is_data_set or self.to is ExportFormat.robot or (not self.to and bool(self.robot))
        )

    @property
    def is_data_set(self) -> bool:
        """Whether a data set is asked for, which may be of many results."""
        return self.to is ExportFormat.lerobot

    @model_validator(mode="after")
    def _all_is_used(self) -> "ExportRequest":
        unused: dict[str, str] = dict.fromkeys(("robot", "frames"), "the motion of a robot")
        if self.is_of_robot:
            fields = ("bones", "skeleton", "blender", "up", "units", "reduce_keys")
            unused = dict.fromkeys(fields, "files of other programs")
        if not self.is_data_set:
            unused |= dict.fromkeys(("all_samples", "task"), "a data set")
        elif self.all_samples:
            unused["sample"] = "one sample"
        for field, kind in unused.items():
            if getattr(self, field) != type(self).model_fields[field].default:
                raise InputError(
                    "option-unused",
                    f"This option is only for {kind}.",
                    field=field,
                    fix=f"Leave it out, or change ‹to›, which is {self.to or 'not given'}.",
                )
        return self
