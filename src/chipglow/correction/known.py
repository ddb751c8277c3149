"""Zones from results of the laboratory: emissivities of regions, and a tool."""

from collections.abc import Mapping, Sequence
from typing import Final

from chipglow.correction.zones import Zone
from chipglow.laboratory.emissivity import EmissivityLine
from chipglow.scene import Region, Tool

TOOL: Final = "tool"
"""Name of the tool's emissivity and zone."""

GRAIN: Final = 20e-6
"""Length in m over which emissivity changes if it is not known: the paper's grain."""


def known_zones(
    emissivities: Mapping[str, EmissivityLine] | EmissivityLine,
    regions: Sequence[Region] = (),
    tool: Tool | None = None,
    elsewhere: str | None = None,
    grain: float = GRAIN,
) -> tuple[Zone, ...]:
    """Return the zones of an image.

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
    grain : float
        Length in m over which the emissivity changes within a region.

    Raises
    ------
    ValueError
        If `elsewhere` names no emissivity, or the emissivity of a tool is unknown.
    """
    if isinstance(emissivities, EmissivityLine):
        names = {name for region in regions for name in (region.name, region.feature)}
        named = dict.fromkeys({*names, TOOL, ""}, emissivities)
        elsewhere = "" if elsewhere is None else elsewhere
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
    outside = None if elsewhere is None else named[elsewhere]
    zones = [_zone(elsewhere or "elsewhere", outside, None, grain)]
    for region in regions:
        line = named.get(region.name, named.get(region.feature))
        zones.append(_zone(region.name, line, region, grain))
    if tool is not None:
        zones.append(_zone(TOOL, named[TOOL], tool, grain))
    return tuple(zones)


def _zone(
    name: str, line: EmissivityLine | None, shape: Region | Tool | None, grain: float
) -> Zone:
    if line is None:
        return Zone(name, None, shape)
    value = line.at(line.middle)
    return Zone(
        name,
        float(value.values),
        shape,
        float(value.standard_uncertainty),
        line.standard_deviation,
        grain,
    )
