"""What sources of other programs refuse beside the declared limits, which test_part covers."""

import numpy as np
import pytest

from chipglow.io.sources import Placement
from chipglow.io.sources.grids.grid import GridSource
from chipglow.io.sources.meshes.mesh import MeshSource
from chipglow.io.sources.meshes.triangles import rasterise
from chipglow.io.sources.movies.colour_scale import ColourScale
from chipglow.io.sources.movies.movie import FieldMovie, MovieSource
from chipglow.io.sources.points.cloud import CloudSource
from chipglow.io.sources.source import even_times
from chipglow.scene import Raster
from chipglow.text import Notes

RASTER = Raster(0.0, 0.0, 1.0, 2, 2)
OTHER_AXES = Placement("x", "z")
SAME_POINT = {"scale_from": (1, 1), "scale_to": (1, 1), "scale_length": 1.0, "pixel": None}


def movie(**changed):
    return MovieSource(FieldMovie("a.avi", 293.0, 1400.0, "jet"), **{"pixel": 2e-6, **changed})


def scale(name):
    return ColourScale.named(name, (293.0, 1400.0))


REFUSED = {
    "axes: .* in any order": lambda: GridSource("T.npy", axes=("time", "x")),
    "files: unknown field 'heat'": lambda: GridSource({"heat": "T.npy"}),
    "a grid has the axes x and y, expected no z": lambda: GridSource("T.npy", placement=OTHER_AXES),
    "GridSource.row_spacing: 0": lambda: GridSource("T.npy", row_spacing=0.0),
    "CloudSource.thickness: -1": lambda: CloudSource("p.csv", thickness=-1.0),
    "CloudSource.depth: nan": lambda: CloudSource("p.csv", depth=np.nan),
    "times: expected finite times": lambda: MeshSource("chip.vtu", times=(0.0, np.nan)),
    "interval: times are given too": lambda: MeshSource("c.vtu", interval=1.0, times=(0.0,)),
    "section: 'front' is not a position": lambda: MeshSource("chip.vtu", section="front"),
    "section: inf": lambda: MeshSource("chip.vtu", section=np.inf),
    "pixel: 0 m, expected": lambda: movie(pixel=0.0),
    "scale_to: .* another point": lambda: movie(files="a", **SAME_POINT),
    "every: 0, expected 1 or more": lambda: movie(every=0),
    "colour: .* of 0 to 255": lambda: movie(tool_colour=(300, 0, 0)),
    "tool_polygon: 1 corner": lambda: movie(tool_polygon=((1, 2),)),
    "placement: .* expected x and y": lambda: movie(placement=OTHER_AXES),
    "origin.0: nan, expected a finite number": lambda: movie(origin=(np.nan, 0)),
    "hsv: colours: .* have the same colour": lambda: scale("hsv"),
    "twilight: colours: .* have the same colour": lambda: scale("twilight"),
    "flag: colours: .* have the same colour": lambda: scale("flag"),
    "jett: unknown colour map": lambda: scale("jett"),
    "interval: 0.* expected more than 0": lambda: even_times(3, 0.0, Notes()),
    "interval: -1.* expected more than 0": lambda: even_times(3, -1e-6, Notes()),
    "interval: nan.* expected more than 0": lambda: even_times(3, np.nan, Notes()),
    "interval: inf.* expected more than 0": lambda: even_times(3, np.inf, Notes()),
    "nodes 0 to 1, expected 0 to 0": lambda: rasterise(RASTER, [(0, 0)], [(0, 0, 1)]),
    "nodes -1 to 0": lambda: rasterise(RASTER, [(0, 0)], [(0, -1, 0)]),
}


@pytest.mark.parametrize("message", REFUSED)
def test_the_impossible_is_refused(message):
    with pytest.raises(ValueError, match=message):
        REFUSED[message]()
