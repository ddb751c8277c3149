"""What a cut's grid does not resolve is said."""

from math import nan

import pytest
from analytic_chip import AnalyticChip

from chipglow.chip import resolution_warnings
from chipglow.cutting import CuttingConditions, CuttingSimulation, Numerics, unresolved
from chipglow.scene import Scene, ToolGeometry


@pytest.mark.parametrize(("cells", "said"), [(4.99, 1), (5.0, 0), (50.0, 0)])
def test_a_length_needs_five_cells(cells, said):
    assert len(unresolved({"feed": cells * 10e-6}, 10e-6)) == said


def test_what_is_unknown_or_sharp_is_not_said():
    assert unresolved({"shear band": nan, "edge radius": 0.0}, 10e-6) == ()


def test_a_feed_of_a_cell_and_a_small_edge_are_named_with_the_cell_that_would_do():
    simulation = CuttingSimulation(
        CuttingConditions(feed=20e-6),
        ToolGeometry(edge_radius=30e-6),
        numerics=Numerics(cell=20e-6),
    )
    feed, edge = simulation.resolution_warnings
    assert (
        feed == "The feed, 20 um, is 1 cell, expected 5 or more: set cutting.numerics.cell to 4 um."
    )
    assert edge.startswith("The edge radius, 30 um, is 1.5 cells")


def test_the_band_is_judged_after_the_cut():
    data = AnalyticChip(frames=3).scene().data
    assert resolution_warnings(Scene(data), 1e-6) == ()
    known = {"cell": 10e-6, "resolution_warnings": "The feed.\nThe edge."}
    scene = Scene(data.assign_attrs(known))
    assert resolution_warnings(scene) == ("The feed.", "The edge.")
    assert resolution_warnings(scene, 30e-6)[2].startswith("The shear band, 30 um, is 3 cells")
    assert len(resolution_warnings(scene, 60e-6)) == 2
