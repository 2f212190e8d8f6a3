"""Numbers of the geometry: the grid of signed distances, and headings."""

from dataclasses import dataclass

from omomo_core.config import setting


@dataclass(frozen=True)
class DistanceFieldConfig:
    """The grid on which the signed distance to an object's surface is measured."""

    margin: float = setting(0.15, "m", "Least width of the grid around the object.")
    touching: float = setting(
        1e-4, "m", "Distance from the surface below which the grid's slope decides the direction."
    )
    finest: float = setting(
        0.008, "m", "Least distance of grid points: thinner parts are met, but have no depth."
    )
    coarsest: float = setting(0.025, "m", "Largest distance of grid points.")
    points: int = setting(
        400_000,
        "count",
        "Grid points between these limits, which take about 0.4 s of one core.",
    )
    stride: int = setting(
        3,
        "grid steps",
        "Distance of the points that are measured away from the surface; the others are interpolated.",
    )
    band: float = setting(
        1.25,
        "strides",
        "Distance from the surface below which every grid point is measured.",
    )
    crossing: float = setting(
        1.3,
        "share",
        "Sum of the distances of two points to the surface, over that from one to the other, up to which "
        "it may lie between them. One would do, but winding numbers change fast around the rim of a hole.",
    )
    grid_error: float = setting(
        0.25,
        "grid steps",
        "Distance to the surface, as the grid has it, below which a point may in truth be deep inside.",
    )
    winding_accuracy: float = setting(
        1.5,
        "sizes",
        "Distance from a part of the surface, in sizes of the part, beyond which its winding number is "
        "approximated (Barill et al. 2018); the error is 0.06 turns at most on our objects.",
    )


@dataclass(frozen=True)
class HeadingConfig:
    """Headings of canonical frames."""

    shortest_travel: float = setting(
        0.25, "m", "Way of an object in a window below which it has no heading of travel."
    )


DISTANCE_FIELD = DistanceFieldConfig()
HEADING = HeadingConfig()


@dataclass(frozen=True)
class GeometryConfig:
    """All numbers of the geometry."""

    distance_field: DistanceFieldConfig = DISTANCE_FIELD
    heading: HeadingConfig = HEADING


GEOMETRY = GeometryConfig()
