"""The kinds of jobs there are."""

from capture_app.jobs.kinds import compare, export, render, resolve, run
from capture_app.jobs.work import Kind

KINDS: dict[str, Kind] = {
    kind.order.KIND: kind
    for kind in (run.KIND, resolve.KIND, render.KIND, export.KIND, compare.KIND)
}
