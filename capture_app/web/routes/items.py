"""Sessions, objects, mounts, videos and contacts: listed, renamed, and deleted unless a job needs them."""

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from fastapi import APIRouter
from pydantic import ConfigDict, Field

from capture_app.calibration.mount_words import mount_words
from capture_app.commands.inputs import DescribedModel, ItemKind
from capture_app.library_item import Info, Name, mesh_summary
from capture_app.manifest import MANIFEST, read_manifest
from capture_app.web.library import SHELVES, Library
from capture_app.web.page_words import all_in_page_words
from capture_app.web.problems import Refused
from capture_app.web.site import Here, Site, ThingId
from capture_app.web.sources import mesh_file_of
from ingest.uncertainty import ConfidenceRadii
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


class LibraryItem(DescribedModel):
    """A thing of the library; each kind says more of it."""

    model_config = ConfigDict(extra="allow")

    id: str
    """16 hex digits."""
    name: str
    """What people call it."""
    created: datetime
    """When it came, UTC."""
    size: int
    """Bytes of all its files."""
    files: int
    """How many they are."""


class Rename(DescribedModel):
    """A new name."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"name": "the blue chair"}]})

    name: Name
    """What to call it from now on."""


class Change(DescribedModel):
    """What may be changed of an object."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"name": "the blue chair"}, {"scale": 0.01}]}
    )

    name: Name | None = None
    """What to call it from now on; as before if not given."""
    scale: float | None = Field(None, gt=0, le=1000, allow_inf_nan=False)
    """Factor that brings its mesh to metres; as before if not given."""


def item(id_: str, info: Info) -> LibraryItem:
    """Return what a list tells of a thing."""
    head = info.model_dump(exclude={"facts"})
    facts = info.facts | (_of_mount(info.facts) if "method" in info.facts else {})
    return LibraryItem(id=id_, **{**all_in_page_words(facts), **head})


def _of_mount(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is said of a mount in sentences."""
    bounds = None if facts["bounds"] is None else ConfidenceRadii(**facts["bounds"])
    said = mount_words(facts["method"], bounds, facts.get("residuals", {}))
    return said | {"warnings": [*said["warnings"], *facts.get("warnings", [])]}


def routes(kind: ItemKind) -> APIRouter:
    """The routes of one kind."""
    router = APIRouter(prefix=f"/api/{SHELVES[kind]}", tags=[SHELVES[kind]])

    @router.get("")
    def list_(site: Here) -> list[LibraryItem]:
        """All there are, the newest first."""
        return [item(id_, info) for id_, info in site.library.shelves[kind].list()]

    @router.get("/{id}")
    def get(site: Here, id: ThingId) -> LibraryItem:
        """What is known of one."""
        return item(id, site.library.shelves[kind].get(id))

    @router.delete("/{id}", status_code=204)
    def delete(site: Here, id: ThingId) -> None:
        """Delete one; not while a job needs it."""
        site.library.shelves[kind].get(id)
        refuse_in_use(site, id)
        site.library.shelves[kind].remove(id)

    if kind == "object":
        router.patch("/{id}", name="change")(change_object)
    else:

        @router.patch("/{id}")
        def rename(site: Here, id: ThingId, given: Rename) -> LibraryItem:
            """Give it another name."""
            named = site.library.shelves[kind].change(id, renamed(given.name))
            return item(id, named)

        assert rename

    assert list_
    assert get
    assert delete
    return router


async def change_object(site: Here, id: ThingId, given: Change) -> LibraryItem:
    """Give an object another name, or read its mesh in another unit."""
    facts: dict[str, Any] = {}
    if given.scale is not None:
        facts = await site.sandbox.run(
            mesh_summary, mesh_file_of(site.library, id).path, given.scale
        )

    def edit(info: Info) -> Info:
        update = {"name": given.name or info.name, "facts": {**info.facts, **facts}}
        return info.model_copy(update=update)

    return item(id, site.library.shelves["object"].change(id, edit))


def renamed(name: str) -> Any:
    """An edit of a record that gives it another name."""
    return lambda info: info.model_copy(update={"name": name})
