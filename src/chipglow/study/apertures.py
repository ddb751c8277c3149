"""What a list of images of apertures says."""

from typing import Annotated

from pydantic import Field, Strict

from chipglow.study.section import FileBeside, Section
from chipglow.study.units import Length


class ApertureSection(Section):
    """An image of a round aperture."""

    file: FileBeside = Field(description="The measurement.")
    diameter: Length = Field(description="Diameter of the aperture on the object.")


class ApertureList(Section):
    """Images of apertures of several diameters before one source."""

    apertures: Annotated[tuple[ApertureSection, ...], Strict(False)] = Field(
        description="The images."
    )
