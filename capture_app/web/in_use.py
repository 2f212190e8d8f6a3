"""Which things of the library a job that is not over still needs."""

from pathlib import Path

from capture_app.web.problems import Refused
from capture_app.web.site import Site

_ACTIVE = ("queued", "running", "cancelling")
_MOST = 10_000


def refuse_in_use(site: Site, id_: str) -> None:
    """Refuse to take away what a job reads.

    Raises:
        Refused: 409 with the job's name.
    """
    for state in _ACTIVE:
        for record in site.queue.list(limit=_MOST, state=state):
            if id_ in {site.library.holder(Path(given.path)) for given in record.inputs}:
                raise Refused(
                    409,
                    "in-use",
                    f"The job '{record.name or record.kind}' still needs it.",
                    where=record.id,
                    fix="Wait for it, or cancel it first.",
                )
