"""Parts of the image from results of the laboratory: emissivities of regions, and a tool."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from chipglow.correction.zones import Zone
from chipglow.laboratory.emissivity import EmissivityLine
from chipglow.laboratory.emissivity.places import ELSEWHERE, TOOL
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene import Region, Tool
from chipglow.scene.regions import named_value

GRAIN: Final = 20e-6
"""Length in m over which emissivity changes if it is not known: the paper's grain."""


@dataclass(frozen=True, eq=False)
class KnownPart:
    """A part of the image, and its emissivity over the temperature.

    Parameters
    ----------
    name : str
        Name of the zone.
    line : EmissivityLine or None
        None: not known, so that no temperature is determined there.
    shape : Region, Tool or None
        Outline in the measurement's coordinates; None: the rest of the image.
    """

    name: str
    line: EmissivityLine | None
    shape: Region | Tool | None = None

    def zone(self, kelvins: float) -> Zone:
        """Return the zone with its emissivity at a temperature in K."""
        if self.line is None:
            return Zone(self.name, None, self.shape)
        value = self.line.at(kelvins)
        if not 0 < float(value.values) <= 1:
            raise ValueError(
                f"emissivity: that of {self.name!r} is {float(value.values):.3g} at "
                f"{kelvins - ZERO_CELSIUS:.0f} °C by its line over the temperature, must be above "
                "0 and at most 1"
            )
        return Zone(
            self.name,
            float(value.values),
            self.shape,
            float(value.standard_uncertainty),
            self.line.standard_deviation,
            GRAIN,
        )


def known_parts(
    emissivities: Mapping[str, EmissivityLine] | EmissivityLine,
    regions: Sequence[Region] = (),
    tool: Tool | None = None,
    elsewhere: str | None = None,
) -> tuple[KnownPart, ...]:
    """Return the parts of an image with their emissivities.

    Parameters
    ----------
    emissivities : mapping of str to EmissivityLine, or EmissivityLine
        Emissivities by the names of regions or features, or one for the whole image.
    regions : sequence of Region
        Regions of the image. Those without an emissivity of their name or feature are not
        determined.
    tool : Tool, optional
        The tool in the measurement's coordinates; its emissivity has the name ``tool``.
    elsewhere : str, optional
        Name of the emissivity outside all regions. By default nothing is determined there.

    Raises
    ------
    ValueError
        If `elsewhere` names no emissivity, or the emissivity of a tool is unknown.
    """
    if isinstance(emissivities, EmissivityLine):
        names = {name for region in regions for name in (region.name, region.feature)}
        named = dict.fromkeys({*names, TOOL, ELSEWHERE}, emissivities)
        elsewhere = ELSEWHERE if elsewhere is None else elsewhere
    else:
        named = dict(emissivities)
    if elsewhere is not None and elsewhere not in named:
        raise ValueError(
            f"elsewhere: {elsewhere!r} has no emissivity; known are {', '.join(named)}"
        )
    if tool is not None and TOOL not in named:
        raise ValueError(
            f"emissivity: none of {', '.join(named)} is named {TOOL!r}, but the measurement has a "
            "tool; determine its emissivity too"
        )
    parts = [KnownPart(elsewhere or ELSEWHERE, named.get(elsewhere or ELSEWHERE))]
    for region in regions:
        line = named_value(named, region)
        parts.append(KnownPart(region.name, line, region))
    if tool is not None:
        parts.append(KnownPart(TOOL, named[TOOL], tool))
    return tuple(parts)
