"""How much the server takes in."""

from dataclasses import dataclass

from ingest.archive import MAX_BYTES, MAX_ENTRIES
from ingest.mesh import MAX_BYTES as MESH_BYTES

MIB = 2**20


@dataclass(frozen=True)
class Limits:
    """Bounds on what a client may send, in bytes unless they say otherwise."""

    chunk: int = 64 * MIB
    """Of one request of an upload."""
    file: int = MAX_BYTES
    upload: int = MAX_BYTES
    """Of all its files together."""
    files: int = MAX_ENTRIES
    """In one upload; as many as an archive may hold."""
    mesh: int = MESH_BYTES
    small: int = 8 * MIB
    """Of a mount or a list of contacts."""
    listing: int = 64 * MIB
    """Of the request that lists the files of an upload."""
    json: int = 10 * MIB
    """Of any other request."""
    spare: int = 256 * MIB
    """Left free on the disk for everything else."""
    silence: float = 30.0
    """Seconds that a client may say nothing in the middle of a request."""
    orphan: float = 24 * 3600.0
    """Seconds after which an upload that nobody went on with is swept away."""
