"""A result drawn into a film of the take."""

from typing import TYPE_CHECKING

from capture_app.jobs.kinds.file import FileWork
from capture_app.jobs.orders import OverlayOrder
from capture_app.jobs.work import Attempt, Kind

if TYPE_CHECKING:
    from capture_app.overlay.write import OverlayRequest


def _start(order: OverlayOrder, attempt: Attempt) -> FileWork:
    from capture_app.overlay.write import overlay_result

    def write() -> None:
        made = overlay_result(_request(order), attempt.progress)
        for note in made.notes:
            attempt.say(note)
        if made.offset is not None:
            attempt.tell({"offset": round(made.offset, 3)})

    return FileWork("video", write, [order.output])


def _request(order: OverlayOrder) -> "OverlayRequest":
    from capture_app.overlay.find import Said
    from capture_app.overlay.in_scan import Scan
    from capture_app.overlay.write import OverlayRequest
    from render.overlay import OverlayStyle

    scan = None
    if order.scan is not None:
        scan = Scan(order.scan, order.scan_images, order.model_to_object, order.scanned_at)
    said = Said(
        video=order.video,
        camera=order.camera,
        board=order.board,
        in_room=order.in_room,
        board_place=order.board_place,
        shared_world=order.shared_world,
        scan=scan,
        offset=order.offset,
    )
    style = OverlayStyle(order.thing, order.opacity, order.wipe)
    return OverlayRequest(order.result, order.output, said, order.sample, style, order.smooth)


KIND = Kind(OverlayOrder, _start, {"board": 0.3, "localise": 0.1, "video": 0.6})
