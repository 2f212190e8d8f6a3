"""from_pictures: where the cameras were, and what their lens is, by the pictures alone."""

import shutil
from pathlib import Path

from ingest.colmap import pycolmap
from ingest.scan.cameras.quiet import THREADS, quiet
from ingest.scan.cameras.reconstruction import cleaned, names_of, refine
from ingest.scan.types import Progress
from omomo_core.errors import InputError

_FEWEST, _SHARE = 8, 0.4
"""Pictures in the largest model, and their part of all, below which there is no scan."""
_OFF = 3.0
"""Pixels that a point may be off at last."""


def from_pictures(
    database: Path,
    images: Path,
    output: Path,
    count: int,
    *,
    known_lens: bool,
    progress: Progress,
) -> pycolmap.Reconstruction:
    """The largest of the models that COLMAP makes, one picture after the other.

    Args:
        database: with features and matches.
        images: folder of the pictures.
        output: folder for COLMAP's models; emptied.
        count: of pictures.
        known_lens: keep focal lengths and lenses as they are.
        progress: called with the stage "cameras".

    Raises:
        InputError: "scan-overlap" when the pictures do not hang together.
    """
    quiet()
    shutil.rmtree(output, ignore_errors=True)
    output.mkdir(parents=True)
    placed = 0

    def on_next_image() -> None:
        nonlocal placed
        placed += 1
        progress("cameras", min(placed / count, 1.0))

    models = pycolmap.incremental_mapping(
        database, images, output, options=_options(known_lens), next_image_callback=on_next_image
    )
    sizes = sorted((model.num_reg_images() for model in models.values()), reverse=True)
    if not sizes or sizes[0] < max(_FEWEST, _SHARE * count):
        groups = f"at most {sizes[0]} of {count} hang together" if sizes else "no two fit"
        raise InputError(
            "scan-overlap",
            f"The pictures do not overlap enough: {groups}"
            f"{f', in {len(sizes)} groups' if len(sizes) > 1 else ''}.",
            where=str(images),
            fix="Walk around the object in small steps so that neighbouring pictures share two "
            "thirds of what they show, and close the round; a patterned floor helps.",
        )
    model = max(models.values(), key=lambda one: one.num_reg_images())
    refine(model, intrinsics=not known_lens)
    cleaned(model, _OFF * max(max(c.width, c.height) for c in model.cameras.values()) / 960)
    assert names_of(model)
    return model


def _options(known_lens: bool) -> pycolmap.IncrementalPipelineOptions:
    options = pycolmap.IncrementalPipelineOptions()
    options.num_threads = THREADS
    options.random_seed = 0
    options.min_model_size = 5
    options.max_num_models = 10
    options.extract_colors = False
    options.ba_refine_focal_length = options.ba_refine_extra_params = not known_lens
    options.mapper.abs_pose_refine_focal_length = not known_lens
    options.mapper.abs_pose_refine_extra_params = not known_lens
    # A walk of two hundred pictures needs no refinement of all after each tenth of them.
    options.ba_global_frames_ratio = options.ba_global_points_ratio = 1.3
    options.ba_global_max_refinements = 2
    return options
