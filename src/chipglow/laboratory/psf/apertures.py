"""What a list of images of apertures says."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from chipglow.quantities import FileBeside, Parameter, Part
from chipglow.quantities.units import LENGTH
from chipglow.text import load_described


@dataclass(frozen=True)
class ApertureSection(Part):
    """An image of a round aperture."""

    file: Annotated[FileBeside, Parameter("The measurement.")]
    diameter: Annotated[float, Parameter("Diameter of the aperture on the object.", LENGTH)]


@dataclass(frozen=True)
class ApertureList(Part):
    """Images of apertures of several diameters before one source."""

    apertures: Annotated[tuple[ApertureSection, ...], Parameter("The images.")]


def load_apertures(path: str | Path) -> list[tuple[Path, float]]:
    """Read a list of images of apertures from a YAML file.

    Parameters
    ----------
    path : str or Path
        The file: ``apertures: [{file: small.nc, diameter: 50 um}, ...]``. Images are looked up
        beside it.

    Returns
    -------
    list of tuple
        Each image's file and the aperture's diameter in m.

    Raises
    ------
    DescriptionError
        If the file is no YAML or no such list.
    OSError
        If the file cannot be read.
    """
    found = load_described(ApertureList, path)
    return [(Path(aperture.file), aperture.diameter) for aperture in found.apertures]
