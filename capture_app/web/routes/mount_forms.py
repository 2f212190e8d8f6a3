"""The forms of mounts without a recording: the phone is the object, a drawing, clicked points."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from capture_app.commands.calibrate import DrawingWay, PointsWay
from capture_app.commands.inputs import with_example
from capture_app.library_item import Name
from capture_app.web.by_id import by_id
from capture_app.web.library.ids import Id

_LEFT_OUT = ("mesh_scale", "format")
"""The library knows the unit of a mesh, and there is no log."""


class IdentityForm(BaseModel):
    """The phone's frame is the object's."""

    model_config = with_example(method="identity", name="the phone itself")

    method: Literal["identity"]
    name: Name


@by_id(DrawingWay, leave_out=_LEFT_OUT)
class DrawingForm(BaseModel):
    """A holder's drawing says where the phone is; one of axes, euler and quaternion."""

    model_config = with_example(
        method="drawing",
        name="printed holder",
        phone="iPhone 15",
        xyz=[0, 0.12, 0.31],
        axes="screen faces +y, top edge points +z",
    )

    method: Literal["drawing"]
    name: Name
    object: Id | None = None


@by_id(PointsWay, leave_out=_LEFT_OUT)
class PointsForm(BaseModel):
    """Points measured on the phone and clicked on the object."""

    model_config = with_example(
        method="points",
        name="clamped to the back rest",
        object="0123456789abcdef",
        phone="iPhone 15",
        pairs=[
            {"phone": "top left back corner", "point": [0.1, 0.22, 0.05]},
            {"phone": "top right back corner", "point": [0.17, 0.22, 0.05]},
            {"phone": "bottom left back corner", "point": [0.1, 0.07, 0.05]},
        ],
    )

    method: Literal["points"]
    name: Name
    object: Id


MountForm = Annotated[IdentityForm | DrawingForm | PointsForm, Field(discriminator="method")]
