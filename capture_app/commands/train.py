"""What can be asked of training: networks from clips, and clips from recorded motion."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

_METRES_PER_UNIT = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
MethodName = Literal["capture", "omomo", "single-stage", "goal"]
ShareAlike = Annotated[
    bool, Field(description="Use share-alike sources (HDM05); weights inherit the licence.")
]


class TrainRequest(BaseModel):
    """The networks of a method are trained on clips and recordings; `omocap train` has its options."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    method: MethodName
    """Whose networks are trained; capture is the one that ships."""
    data: tuple[Path, ...]
    """Recordings (folders or files: BVH, npz, AMASS, the OMOMO release's .p), or clips of
    `omocap data build` and data sets of `omocap data synthesise`."""
    output: Path
    """The folder of the run; given again, the run is resumed."""
    stage: Annotated[
        str,
        Field(description="hands, body, or both one after the other (capture, omomo)."),
    ] = "both"
    size: Annotated[
        Literal["published", "laptop"],
        Field(description="published, or laptop: smaller networks (omomo, single-stage, goal)."),
    ] = "published"
    start_from: Annotated[
        Path | None,
        Field(
            description="Folder of weights to go on from, of the same method and size, or the word "
            "shipped for those that ship (capture)."
        ),
    ] = None
    steps: Annotated[
        int | None,
        Field(ge=1, description="Optimiser steps per network; else as the method's recipe."),
    ] = None
    batch: Annotated[int, Field(ge=1, description="Windows of 4 s per step.")] = 64
    rate: Annotated[
        float | None,
        Field(gt=0, description="Peak learning rate; else as the method's recipe."),
    ] = None
    synthesis_share: Annotated[
        float,
        Field(
            ge=0,
            le=1,
            description="Share of windows with an object in the batches of capture's body.",
        ),
    ] = 0.75
    seed: Annotated[
        int, Field(ge=0, description="Seed of weights, windows, noise and synthesis.")
    ] = 0
    save_every: Annotated[int, Field(ge=1, description="Steps between saves.")] = 500
    synthetic: Annotated[
        int | None,
        Field(
            ge=0,
            description="Clips with objects to synthesise from recordings; by default 4200, or none "
            "where an hour of the data has objects.",
        ),
    ] = None
    share_alike: ShareAlike = True
    bvh_unit: Annotated[Literal["m", "cm", "mm", "in"], Field(description="Unit of BVH files.")] = (
        "cm"
    )
    object_split: Annotated[
        bool, Field(description="Of the release's files use the paper's ten objects only.")
    ] = False
    workers: Annotated[int, Field(ge=1, description="Processes that synthesise.")] = 1

    @property
    def metres_per_unit(self) -> float:
        """Metres in a unit of the BVH files."""
        return _METRES_PER_UNIT[self.bvh_unit]


class SynthesisRequest(BaseModel):
    """Recorded motion becomes a data set of people who move things."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    mocap: tuple[Path, ...]
    """Folders or files of recordings, clips that `omocap data build` made of them, or data sets."""
    output: Path
    """The folder of the data set; given again, the synthesis is resumed."""
    count: Annotated[int, Field(ge=1, description="Clips to make, of 4 to 10 s each.")] = 4000
    seed: Annotated[int, Field(ge=0, description="The same seed makes the same clips.")] = 0
    workers: Annotated[int, Field(ge=1, description="Processes to use.")] = 1
    share_alike: ShareAlike = True
    people: Annotated[
        str, Field(description="Who of sub1 to sub17 acts; the paper learns from 1-15.")
    ] = "1-17"
    objects: Annotated[
        str,
        Field(description="all, the paper's ten seen or five unseen, or names: monitor,mop."),
    ] = "all"
