"""ScanNet++: `pose` is ARKit's; `aligned_pose` is another world and camera."""

from pathlib import Path

from ingest.formats import scannetpp
from tests.ingest.formats.logs import MakeTake, edit_json, error_of, write_log


def test_it_does_not_take_the_aligned_pose_for_the_pose(take: MakeTake, tmp_path: Path):
    log = write_log(scannetpp, take(0), tmp_path)
    edit_json(log, lambda frames: [frame.pop("pose") for frame in frames.values()])
    error = error_of(tmp_path)
    assert error.code == "pose-missing"
    assert error.where == f"{log}, frame_000000"
