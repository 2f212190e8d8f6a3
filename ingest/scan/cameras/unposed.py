"""from_pictures: where the cameras were, and what their lens is, by the pictures alone."""

import shutil
from pathlib import Path

from ingest.colmap import pycolmap
from ingest.scan.cameras.merging import joined
from ingest.scan.cameras.quiet import THREADS, quiet
from ingest.scan.cameras.reconstruction import cleaned, names_of, refine, triangulated
from ingest.scan.types import Progress
from omomo_core.errors import InputError

_FEWEST, _SHARE = 8, 0.4
"""Pictures in the largest model, and their part of all, below which there is no scan."""
_OFF = 3.0
"""Pixels (of a picture 960 wide) that a point may be off at last."""
_JOINED = 8.0
"""The same before models that were joined are refined together."""


def from_pictures(
    database: Path,
    images: Path,
    output: Path,
    count: int,
    *,
    known_lens: bool,
    progress: Progress,
) -> pycolmap.Reconstruction:
    """The largest of the models that COLMAP makes, one picture after the other, and what joins it.

    Where the film breaks, COLMAP begins another model; it is joined where both share pictures.

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
    largest_first = sorted(models.values(), key=lambda one: -one.num_reg_images())
    sizes = [model.num_reg_images() for model in largest_first]
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
    model = _finished(largest_first[0], known_lens)
    if (poses := joined(largest_first)) is not None:
        more = triangulated(
            database, images, output, poses.T_model_camera, _JOINED * _wide(model), poses.cameras
        )
        more = _finished(more, known_lens)
        if more.num_reg_images() > model.num_reg_images():
            model = more
    assert names_of(model)
    return model


def _finished(model: pycolmap.Reconstruction, known_lens: bool) -> pycolmap.Reconstruction:
    """The model refined, without points that are off, in place."""
    refine(model, intrinsics=not known_lens)
    cleaned(model, _OFF * _wide(model))
    return model


def _wide(model: pycolmap.Reconstruction) -> float:
    """How large its pictures are, in widths of 960 pixels."""
    return max(max(c.width, c.height) for c in model.cameras.values()) / 960


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
