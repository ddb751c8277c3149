"""The plan of an analysis: exposures, draws, reference and places."""

from dataclasses import dataclass, field
from typing import Annotated

from chipglow.analysis.places import LinePlace, Place, PointPlace, RegionPlace
from chipglow.camera import ReferenceKind
from chipglow.laboratory.emissivity import RegionSection
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import Length, Position

PointOfScene = tuple[Position, Position]


@dataclass(frozen=True)
class Plan(Part):
    """Numbers to compute from the simulated measurement.

    Parameters
    ----------
    places : tuple of Place
        More places where the error is read.
    cut : bool
        Whether a scene that shows a cut is analysed segment by segment, at the rake face and the
        shear band. Otherwise the scene is analysed exposure by exposure.

    Raises
    ------
    ValueError
        If a number is not positive, there are no widths, or two places have the same name.
    """

    exposures: Annotated[
        int, Parameter("Exposures, spread evenly over the scene.", least=1, most=10_000)
    ] = 9
    phases: Annotated[
        int,
        Parameter(
            "Positions of the pixels along each axis, evenly over a pixel, on which each headline "
            "is drawn: 9 gives 81.",
            least=1,
            most=100,
        ),
    ] = 9
    textures: Annotated[
        int,
        Parameter(
            "Textures of the emissivity on which each headline is drawn: of the study's seed "
            "and those after it.",
            least=1,
            most=1000,
        ),
    ] = 5
    rake_chip: Annotated[
        str, Parameter("Chip whose errors are read at the rake face; the paper took its chip 2.")
    ] = "chip 2"
    band_chip: Annotated[
        str, Parameter("Chip whose errors are read at the shear band; the paper took its chip 1.")
    ] = "chip 1"
    reference: Annotated[
        ReferenceKind,
        Parameter(
            "Reference of a pixel's measured temperature, in its square during the "
            "exposure: the largest radiance temperature (maximum, the paper's), that of the mean "
            "radiance (mean) or that in the middle of both (centre); or the same of the true "
            "temperature (true-maximum, true-mean, true-centre)."
        ),
    ] = "maximum"
    psf_widths: Annotated[
        tuple[Length, ...],
        Parameter(
            "Full widths at half maximum of Gaussians for which the headline errors are shown."
        ),
    ] = tuple(width / 1e6 for width in range(4, 21))
    points: Annotated[
        dict[str, PointOfScene],
        Parameter(
            "Points by name where the error is read, instead of rake face and shear band.",
            allowed="{} or positions: {middle of the pool: [0 um, -20 um]}",
        ),
    ] = field(default_factory=dict)
    lines: Annotated[
        dict[str, tuple[PointOfScene, ...]],
        Parameter(
            "Lines by name, from corner to corner.",
            allowed="{} or positions: {across: [[-100 um, 0 um], [100 um, 0 um]]}",
        ),
    ] = field(default_factory=dict)
    regions: Annotated[
        dict[str, RegionSection],
        Parameter(
            "Regions by name: a polygon, a rectangle or a circle.",
            allowed="{} or {pad: {rectangle: [[0 um, 0 um], [100 um, -50 um]]}}; also {circle: "
            "{centre: [0 um, 0 um], radius: 20 um}}",
        ),
    ] = field(default_factory=dict)
    places: tuple[Place, ...] = ()
    cut: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.psf_widths:
            raise ValueError("psf_widths: must have one length or more")
        names = [place.name for place in self.all_places]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two places have the name {name!r}, expected unique names")

    @property
    def all_places(self) -> tuple[Place, ...]:
        """Where the error is read, instead of the rake face and the shear band of a cut."""
        return (
            *(PointPlace(name, point) for name, point in self.points.items()),
            *(LinePlace(name, corners) for name, corners in self.lines.items()),
            *(RegionPlace(name, one.region(name)) for name, one in self.regions.items()),
            *self.places,
        )
