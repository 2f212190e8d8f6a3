"""The manifest of a result: everything needed to make it again, and to judge it."""

import hashlib
import platform
from datetime import UTC, datetime
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from capture_app.commands.request import first_problem
from omomo_core.config import Number
from omomo_core.errors import InputError

FORMAT_VERSION = 2
_REMEMBERED = 2**14
"""Files whose hashes are remembered."""
MOTION, MANIFEST, CONTACTS = "motion.npz", "manifest.json", "contacts.json"
GLB = "motion.glb"
"""Names of the files of a result folder."""


Option = str | int | float | bool | None | tuple[float, float] | tuple[float, float, float]
"""What a run was asked for; two numbers are a place on the floor, three a direction."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Input(_Record):
    """A file or folder the motion was made from."""

    role: Literal["session", "object", "mount", "body", "contacts"]
    path: str
    """Path as the user gave it."""
    sha256: str


class Segment(_Record):
    """The stretch of the take between two tracking failures that was used."""

    index: int
    """Counted from 1."""
    count: int
    start: int
    """First frame at 30 fps from the start of the recording."""
    stop: int


class FloorRecord(_Record):
    """The floor of the recording."""

    height: float
    """Metres along the up axis of the session's own world."""
    source: str


class Correction(_Record):
    """The origin of a result whose contacts were corrected."""

    result: str
    """The folder, as the user gave it."""
    manifest_sha256: str
    """SHA-256 of its manifest.json."""
    sample: int
    """Index of the sample that was corrected."""
    contacts: str
    """The file of the corrected contacts, as the user gave it."""
    contacts_sha256: str


class Versions(_Record):
    """The software that made the result."""

    omocap: str = Field(default_factory=lambda: version("omocap"))
    python: str = Field(default_factory=platform.python_version)
    torch: str = Field(default_factory=lambda: version("torch"))
    numpy: str = Field(default_factory=lambda: version("numpy"))
    machine: str = Field(default_factory=platform.machine)


class BodyRecord(_Record):
    """The body the motion is on."""

    name: str
    credit: str
    height: float
    """Metres."""


class TakeFinding(_Record):
    """What `omocap inspect` found of a take that a person should look at."""

    name: str
    """Name of the check."""
    message: str
    fix: str
    """What to do about it, "" if there is nothing to do."""

    @property
    def sentence(self) -> str:
        """All of it in one line."""
        said = f"{self.name[:1].upper()}{self.name[1:]}: {self.message.rstrip('.')}."
        return f"{said} {self.fix}".rstrip()


class Manifest(_Record):
    """`manifest.json` of a result folder."""

    format_version: Literal[2] = FORMAT_VERSION
    created: datetime = Field(default_factory=lambda: datetime.now(UTC).replace(microsecond=0))
    versions: Versions = Field(default_factory=Versions)
    inputs: tuple[Input, ...]
    options: dict[str, Option]
    """Every option of the run, the seed among them, as given or by default."""
    config: dict[str, Number] = Field(default_factory=dict[str, Number])
    """Every number that shapes a motion, by its name (`manifest_builder.py`); empty in older results."""
    segment: Segment
    floor: FloorRecord
    mount_method: str
    body: BodyRecord
    weights: dict[str, str]
    """SHA-256 of each file of weights, by file name."""
    correction: Correction | None = None
    """In a corrected result, whose inputs, options and weights are those of the first."""
    scores: tuple[dict[str, float], ...]
    """Ranking of each sample."""
    chosen: int
    findings: tuple[TakeFinding, ...] = ()
    """What the checks of the take found, as `omocap inspect` says it; empty in older results."""
    notes: tuple[str, ...]
    """What the user should know about the take, in sentences."""
    faults: tuple[str, ...]
    """What could not be satisfied in the chosen sample, in sentences."""
    grips: tuple[str, ...] = ()
    """How the hands of the chosen sample hold, in sentences; empty in older results."""
    timings: dict[str, float]
    """Seconds spent in each stage."""
    files: tuple[str, ...]


def to_look_at(manifest: Manifest) -> tuple[str, ...]:
    """Return the names of what a person should look at in a result, none if all is well."""
    named = dict.fromkeys(finding.name for finding in manifest.findings)
    return (*named, *(["the motion"] if manifest.faults else []))


def chosen_sample(manifest: Manifest, number: int | None, folder: Path) -> int:
    """Index of the sample that the user numbers from 1; of the best one if not given.

    Raises:
        InputError: "sample-missing".
    """
    count = len(manifest.scores)
    if number is None:
        return manifest.chosen
    if not 1 <= number <= count:
        raise InputError(
            "sample-missing",
            f"There is no sample {number}: the result has {count}.",
            where=str(folder),
            fix=f"Give ‹sample› a number from 1 to {count}.",
        )
    return number - 1


def write_manifest(path: Path, manifest: Manifest) -> None:
    """Write it as indented JSON."""
    path.write_text(manifest.model_dump_json(indent=2) + "\n", encoding="utf-8")


def read_manifest(path: Path) -> Manifest:
    """Read what `write_manifest` wrote.

    Raises:
        InputError: there is none, it is damaged, or from another version of the format.
    """
    try:
        return Manifest.model_validate_json(path.read_bytes())
    except OSError as error:
        raise InputError(
            "result-missing",
            "This is no result folder: it has no manifest.",
            where=str(path),
            fix="Give the folder that ‹omocap run› wrote.",
        ) from error
    except ValidationError as error:
        field, problem = first_problem(error.errors())
        raise InputError(
            "manifest-invalid",
            f"The manifest cannot be read: {field}: {problem}.",
            where=str(path),
            fix="Run the take again with this version of omocap.",
        ) from error


def sha256(path: Path) -> str:
    """Hash of a file's bytes, or of a folder's file names and bytes in sorted order."""
    if path.is_file():
        return _file_hash(path)
    digest = hashlib.sha256()
    for file in sorted(p for p in path.rglob("*") if p.is_file()):
        digest.update(f"{file.relative_to(path).as_posix()}\0{_file_hash(file)}\n".encode())
    return digest.hexdigest()


def _file_hash(path: Path) -> str:
    """Return the hash of a file; what a job has hashed to watch over its inputs is not read again."""
    state = path.stat()
    return _hash_of(path, state.st_ino, state.st_size, state.st_mtime_ns, state.st_ctime_ns)


@lru_cache(_REMEMBERED)
def _hash_of(path: Path, *_state: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
