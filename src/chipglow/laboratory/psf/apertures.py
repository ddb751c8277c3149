"""What a list of images of apertures says."""

from pathlib import Path
from typing import Annotated

from chipglow.quantities import Parameter
from chipglow.quantities.section import FileBeside, Section
from chipglow.quantities.units import LENGTH
from chipglow.text import load_described


class ApertureSection(Section):
    """An image of a round aperture."""

    file: Annotated[FileBeside, Parameter("The measurement.")]
    diameter: Annotated[float, Parameter("Diameter of the aperture on the object.", LENGTH)]


class ApertureList(Section):
    """Images of apertures of several diameters before one source."""

    apertures: Annotated[tuple[ApertureSection, ...], Parameter("The images.")]


def load_apertures(path: str | Path) -> list[tuple[Path, float]]:
    """Read a list of images of apertures from a YAML file."""
    found = load_described(ApertureList, path)
    return [(Path(aperture.file), aperture.diameter) for aperture in found.apertures]
