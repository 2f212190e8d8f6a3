"""A take becomes a motion."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from capture_app.jobs.kinds.folder import FolderWork
from capture_app.jobs.orders import RunOrder
from capture_app.jobs.work import Attempt, Kind

if TYPE_CHECKING:
    from capture_app.pipeline import TakeInMaking
    from capture_app.request import TakeRequest

_SHARES = {
    "read": 0.05,
    "object": 0.02,
    "hands": 0.1,
    "contact": 0.03,
    "body": 0.15,
    "solve": 0.3,
    "export": 0.05,
    "video": 0.3,
}


class _TakeWork(FolderWork):
    """Also tells the verdict on the take."""

    def __init__(self, making: "TakeInMaking", attempt: Attempt) -> None:
        super().__init__(making, attempt)
        self._take = making

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        return {**super().stages, "read": self._read}

    def _read(self) -> None:
        self._take.read()
        self._attempt.tell({"verdict": self._take.prepared.verdict})


def _start(order: RunOrder, attempt: Attempt) -> FolderWork:
    from capture_app.pipeline import TakeInMaking

    making = TakeInMaking(
        request_of(order), attempt.progress, key=attempt.id, timings=attempt.timings
    )
    return _TakeWork(making, attempt)


def request_of(order: RunOrder) -> "TakeRequest":
    """The same, as the pipeline takes it."""
    from capture_app.request import TakeRequest
    from ingest.trajectory.reading import Reading
    from omomo_core.generation.result import GenerationOptions

    return TakeRequest(
        session=order.session,
        mesh=order.object,
        mount=order.mount,
        output=order.output,
        animated=order.animated,
        node=order.node,
        options=GenerationOptions(
            order.samples, order.seed, order.contact, order.sampler, order.steps
        ),
        contacts=order.contacts,
        configuration=order.configuration,
        weights=order.weights,
        body=order.body,
        height=order.height,
        stood=order.stood,
        reading=Reading(
            order.floor, order.up, order.stitch, order.closure, order.segment, order.format
        ),
        mesh_scale=order.mesh_scale,
        video_size=order.video_size,
        replace=order.replace,
        force=order.force,
    )


KIND = Kind(RunOrder, _start, _SHARES)
