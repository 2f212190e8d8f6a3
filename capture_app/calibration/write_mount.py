"""write_mount: what every calibration ends with, the mount file and its picture."""

from dataclasses import replace
from datetime import date
from pathlib import Path

from capture_app.mesh_file import MeshFile
from ingest.mount import Mount, object_id
from ingest.mount_file import save_mount


def write_mount(
    mount: Mount,
    path: Path,
    mesh_file: MeshFile | None = None,
    phone: str = "",
    *,
    picture: Path | None,
) -> Mount:
    """Write the mount file; draw it where its object is known.

    Args:
        mount: the calibration; its date is set to today.
        path: of mount.json.
        mesh_file: the object it is for, when it is known.
        phone: its model, when it is known.
        picture: PNG file to draw both into; None draws nothing.

    Returns:
        The mount as it was written.

    Raises:
        InputError: as `load_mesh`, or a file cannot be written.
    """
    mesh = None if mesh_file is None else mesh_file.load(mount.object_scale)
    dated = replace(
        mount,
        date=date.today().isoformat(),
        phone=phone or mount.phone,
        object_id=mount.object_id or (object_id(mesh, mount.object_scale) if mesh else ""),
        picture=picture.name if picture and mesh else "",
    )
    save_mount(dated, path)
    if picture and mesh:
        from capture_app.calibration.picture import draw_mount

        draw_mount(dated, mesh, picture)
    return dated
