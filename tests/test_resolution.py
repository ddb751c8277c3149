"""What a cut's grid does not resolve is said."""

from dataclasses import replace
from math import nan

import pytest
from analytic_chip import AnalyticChip

from chipglow.chip import resolution_warnings
from chipglow.cutting import AISI_1045, CuttingConditions, CuttingSimulation, Numerics, unresolved
from chipglow.scene import Scene, ToolGeometry


@pytest.mark.parametrize(("name", "needed"), [("feed", 5.0), ("edge radius", 1.0)])
def test_a_length_needs_some_cells(name, needed):
    assert len(unresolved({name: (needed - 0.01) * 10e-6}, 10e-6)) == 1
    assert unresolved({name: needed * 10e-6}, 10e-6) == ()


def test_what_is_unknown_or_sharp_is_not_said():
    assert unresolved({"feed": nan, "edge radius": 0.0}, 10e-6) == ()


def test_the_default_cut_is_resolved_and_a_coarser_one_is_not():
    assert CuttingSimulation().resolution_warnings == ()
    edge, width = CuttingSimulation(numerics=Numerics(cell=25e-6)).resolution_warnings
    assert edge.startswith("The edge radius, 20 um, is 0.8 cells, expected 1 or more: set ")
    assert width.startswith("The length of the nonlocal viscosity, 20 um, is 0.8 cells")


def test_a_feed_of_a_cell_and_a_small_edge_are_named_with_the_cell_that_would_do():
    simulation = CuttingSimulation(
        CuttingConditions(feed=20e-6),
        ToolGeometry(edge_radius=10e-6),
        numerics=Numerics(cell=20e-6),
    )
    feed, edge = simulation.resolution_warnings
    assert (
        feed == "The feed, 20 um, is 1 cell, expected 5 or more: set cutting.numerics.cell to 4 um."
    )
    assert edge.startswith("The edge radius, 10 um, is 0.5 cells")


def test_a_band_whose_width_is_the_cells_is_said():
    local = CuttingSimulation(workpiece=replace(AISI_1045, nonlocal_viscosity=None))
    assert local.resolution_warnings == (
        "The workpiece has no nonlocal viscosity: a shear band is about two cells wide, of any "
        "cell.",
    )


def test_a_scene_keeps_the_sentences():
    data = AnalyticChip(frames=3).scene().data
    assert resolution_warnings(Scene(data)) == ()
    scene = Scene(data.assign_attrs(resolution_warnings="The feed.\nThe edge."))
    assert resolution_warnings(scene) == ("The feed.", "The edge.")
