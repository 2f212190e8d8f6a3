"""transforms.json, the layout that NeRFCapture and nerfstudio share: a list of posed images."""

from pathlib import Path

from ingest.formats.json_file import (
    JsonObject,
    inside,
    list_at,
    load_object,
    member,
    object_at,
    text_at,
)
from ingest.formats.pictures import file_inside
from ingest.formats.records import CameraKeys, Record, Records

FILE = "transforms.json"
CAMERA: CameraKeys = ("fl_x", "fl_y", "cx", "cy", "w", "h")


def log_of(path: Path) -> Path:
    """The file itself, or the one in the folder."""
    return path / FILE if path.is_dir() else path


def read_frames(log: Path) -> tuple[JsonObject, Records]:
    """The whole object and its frames, each with the camera that stands at the top of the file.

    A frame's own camera goes before the common one.
    """
    top = load_object(log)
    common = {key: top[key] for key in CAMERA if key in top}
    frames = list_at(member(top, "frames", log), log, "frames")
    rows = [
        Record(common | object_at(frame, log, f"frame {i}"), log, f"frame {i}")
        for i, frame in enumerate(frames)
    ]
    return top, Records(tuple(rows))


def named_files(records: Records, key: str, *endings: str) -> list[Path | None]:
    """The file that each frame names, with the first ending that is there."""
    files: list[Path | None] = []
    for row in records.rows:
        value = row.values.get(key)
        if value is None:
            files.append(None)
            continue
        name = text_at(value, row.path, inside(row.where, key))
        files.append(file_inside(row.path.parent, *(name + ending for ending in endings)))
    return files
