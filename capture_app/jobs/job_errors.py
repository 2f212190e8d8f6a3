"""Why a job failed, in words for its owner."""

import errno

from capture_app.jobs.record import JobError
from omomo_core.errors import OmocapError

FULL = (errno.ENOSPC, errno.EDQUOT)
"""Numbers of an OSError where the disk has no room."""
_MEMORY = ("MemoryError", "OutOfMemoryError", "ArrayMemoryError")
"""Of Python, of torch on a GPU, of numpy."""


def no_room(error: BaseException) -> bool:
    """Whether there was no room on a disk, of whatever room of the program or of the database."""
    if isinstance(error, OmocapError):
        return error.code == "disk-full"
    return (isinstance(error, OSError) and error.errno in FULL) or "disk is full" in str(error)


def job_error(error: Exception) -> JobError:
    """What to say of an exception; of a defect that it is one, and no more."""
    if isinstance(error, OmocapError):
        return JobError.of(error)
    if type(error).__name__.strip("_") in _MEMORY:
        return JobError(
            code="out-of-memory",
            what="The machine's memory is too small for this job.",
            fix="Order fewer samples or a smaller video, cut the take into shorter ones, or close "
            "other programs.",
        )
    if no_room(error):
        return JobError(
            code="disk-full",
            what="There is no room left on the disk.",
            where=str(getattr(error, "filename", None) or ""),
            fix="Make room, and order the job again.",
        )
    return JobError(
        code="defect",
        what=f"This is a defect of omocap: {type(error).__name__}.",
        fix="Report it, with what the worker's log says of this job.",
    )
