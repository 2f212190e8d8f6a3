"""Which things of the library a job that is not over still needs."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from capture_app.manifest import MANIFEST, read_manifest
from capture_app.web.library.library import Library
from capture_app.web.problems import Refused
from capture_app.web.site import Site
from omomo_core.errors import InputError

_ACTIVE = ("queued", "running", "cancelling")
_MOST = 10_000


def refuse_in_use(site: Site, id_: str) -> None:
    """Refuse to take away what a job reads.

    Raises:
        Refused: 409 with the job's name.
    """
    for state in _ACTIVE:
        for record in site.queue.list(limit=_MOST, state=state):
            if id_ in _needed(site.library, [Path(given.path) for given in record.inputs]):
                raise Refused(
                    409,
                    "in-use",
                    f"The job '{record.name or record.kind}' still needs it.",
                    where=record.id,
                    fix="Wait for it, or cancel it first.",
                )


def _needed(library: Library, inputs: Sequence[Path]) -> set[str | None]:
    """Ids of what these lie in, and of what a result among them was made from, such as its film."""
    made_from = [path for given in inputs for path in _origins(given)]
    return {library.holder(path) for path in (*inputs, *made_from)}


def _origins(result: Path) -> Iterator[Path]:
    if (result / MANIFEST).is_file():
        try:
            yield from (Path(given.path) for given in read_manifest(result / MANIFEST).inputs)
        except InputError:
            return  # its job will say that it is damaged
