"""The kinds of jobs there are."""

from capture_app.jobs.kinds.files import COMPARE, EXPORT, OVERLAY, RENDER
from capture_app.jobs.kinds.items import CALIBRATE, SCAN
from capture_app.jobs.kinds.results import RESOLVE, RUN
from capture_app.jobs.protocol import JobKind

KINDS: dict[str, JobKind] = {
    kind.order.KIND: kind
    for kind in (RUN, RESOLVE, RENDER, EXPORT, OVERLAY, COMPARE, CALIBRATE, SCAN)
}
"""By the kind of their requests."""
