"""TablesRequest: which of the paper's tables are made, from which clips and networks."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field


def _names(value: object) -> object:
    """Names that are given several times, or with commas between them."""
    if not isinstance(value, list | tuple):
        return value
    return tuple(name for each in value for name in str(each).split(","))


class TablesRequest(BaseModel):
    """Methods are run over recorded clips, and the paper's tables 2, 3 and 4 are made of the answers."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    clips: tuple[Path, ...]
    """Recorded clips, data sets of `omocap data synthesise`, or files of the OMOMO release."""
    output: Path
    """The folder to make; given again, it goes on."""
    weights: Annotated[
        Path | None,
        Field(
            description="Folder with a folder of networks for each method: omomo, single-stage, goal, "
            "capture (the one that ships, if it is not there)."
        ),
    ] = None
    samples: Annotated[
        int, Field(ge=1, le=200, description="K: people generated for each window.")
    ] = 20
    seed: Annotated[int, Field(ge=0, description="The same seed gives the same motion.")] = 0
    split: Annotated[
        Literal["seen", "unseen", "train"] | None,
        Field(
            description="Only clips of this side: people 16 and 17 with the ten objects (seen) or the "
            "five (unseen), or the people and objects that were learnt from (train)."
        ),
    ] = None
    sampler: Annotated[
        Literal["dpm++", "ddim", "ddpm"],
        Field(description="The paper's is ddpm, of 1,000 steps."),
    ] = "dpm++"
    steps: Annotated[
        int, Field(ge=1, le=1000, description="Steps of the sampler; more is slower and finer.")
    ] = 10
    methods: Annotated[
        tuple[str, ...],
        BeforeValidator(_names),
        Field(
            description="Only these: goal, single-stage, no-constraints, omomo, gt-hands, capture, "
            "recorded; with commas, or given several times."
        ),
    ] = ()
    limit: Annotated[
        int | None,
        Field(ge=1, description="Windows of each table at most, spread evenly."),
    ] = None
    workers: Annotated[int, Field(ge=1, description="Processes to use.")] = 1
    first_frame: Annotated[
        Literal["both", "given", "none"],
        Field(description="With the person's first pose given, as in the paper, without, or both."),
    ] = "both"

    @property
    def first_frames(self) -> tuple[bool, ...]:
        """Whether the first pose is given, in each run over the windows."""
        asked = {"both": (True, False), "given": (True,), "none": (False,)}
        return asked[self.first_frame]
