"""write_object_model: a scan's COLMAP model in the frame of the object's mesh."""

import shutil
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.colmap_files import read_model
from ingest.scan.cameras.metric import Similarity
from ingest.scan.cameras.reconstruction import laid
from omomo_core.geometry.transforms import inverse


def write_object_model(
    model: Path, T_world_object: Float64[np.ndarray, "4 4"], stretched: float, folder: Path
) -> None:
    """Write the model as `omocap calibrate scan` reads it without any further transform.

    Args:
        model: of `Registered`.
        T_world_object: where the mesh is in the world, metres.
        stretched: metres of that world in one unit of the model.
        folder: for the model, replaced as a whole.
    """
    turned = read_model(model)
    T = inverse(T_world_object)
    laid(turned, Similarity(stretched, T[:3, :3], T[:3, 3]))
    fresh = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir(parents=True)
    turned.write(fresh)
    shutil.rmtree(folder, ignore_errors=True)
    fresh.replace(folder)
