"""The kinds of jobs there are."""

from capture_app.jobs.kinds import calibrate, compare, export, overlay, render, resolve, run, scan
from capture_app.jobs.protocol import JobKind

_ALL = (run, resolve, render, export, overlay, compare, calibrate, scan)
KINDS: dict[str, JobKind] = {room.KIND.order.KIND: room.KIND for room in _ALL}
