"""`omocap overlay`: draw a result into a real film."""

from typing import Any

from capture_app.cli import options
from capture_app.cli.console import progress_bars, say
from capture_app.cli.derived import derived
from capture_app.commands.overlay import OverlayRequest
from capture_app.commands.request import validated
from omomo_core.whole_file import check_target

_ENDINGS = (".mp4", ".webp", ".gif")


@derived(OverlayRequest)
def overlay(result: options.Result, file: options.OutputFile = None, **said: Any) -> None:
    """Draw the person of a result into a film of the take: hidden by the object, with their shadow.

    The film is that of the clamped phone, of a camera on a tripod, or of a second phone.

    Example: `omocap overlay chair_motion --video tripod.mp4 --board A4 -o chair_overlay.mp4`
    """
    target = file or result / "overlay.mp4"
    check_target(target, _ENDINGS)
    from capture_app.overlay.find_camera import FEW, overlay_result

    asked = {**said, "result": result, "output": target}
    request = validated(OverlayRequest, asked, "option-invalid")
    with progress_bars() as progress:
        made = overlay_result(request, progress, lambda told: say("Note", told, "yellow"))
    for note in made.notes:
        say("Note", note, "yellow")
    say("Done", str(target), "green")
    if made.person_shown < FEW:
        say("Done, but look at", "the film: the person is hardly in it", "bold yellow")
