"""TUM trajectories: lines `t tx ty tz qx qy qz qw` in seconds and metres, # comments or a header, poses only.

Any program may write them and none says which way its axes point. Read here as camera poses with
OpenCV's axes (x right, y down, z forward in the landscape image) in a world whose y or z is up; since
nothing vouches for either, both stay open until the object is known. Comment lines `# axes: arkit` (or
opencv) and `# up: y` (or z) state them. Ours are written with them.
"""

from pathlib import Path

from ingest.formats.pose_columns import IN_ORDER, is_in_order
from ingest.formats.pose_table import read_table
from ingest.formats.text_table import logs, only_log
from ingest.session import CaptureSession

NAME = "TUM"
FILES = "a trajectory of `t tx ty tz qx qy qz qw`, or a folder with one"
LACKS = "no tracking state, intrinsics or IMU; axes and up only if comments say so"

_PATTERNS = ("*.txt", "*.tum")


def detect(path: Path) -> bool:
    """Whether the file, or a .txt or .tum file of the folder, has eight numbers of a pose between blanks."""
    return bool(logs(path, _PATTERNS, is_in_order))


def read(path: Path) -> CaptureSession:
    """Read a trajectory file, or a folder that holds exactly one.

    Raises:
        InputError: "axes-unknown" for a comment that states other axes than those above; besides
            what every log is checked for.
    """
    log = only_log(path, logs(path, _PATTERNS, is_in_order))
    return read_table(NAME, path, log, IN_ORDER, "opencv")
