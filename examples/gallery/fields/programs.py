"""
One block from six programs
===========================

.. image:: images/sphx_glr_programs_001.png
   :alt: One block from six programs

The files in which AdvantEdge, DEFORM, Abaqus, LS-DYNA, Ansys and OpenFOAM would give the same
block, in mm and °C, or in SI: each is imported with its description in the documentation.

What you see: the temperature that arrives. A wrong unit, axis or origin would show; below is how
far the six differ from the written values: linear between nodes 10 µm apart, or constant in
OpenFOAM's cells.

More: :doc:`/do/import` and :doc:`/do/from-programs`.
"""

import re

import numpy as np
import sample_files

import chipglow
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import HEAT
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene import Material
from chipglow.scene.figures import show_image

PROGRAMS = {
    "AdvantEdge": "advantedge.yaml",
    "DEFORM": "deform.yaml",
    "Abaqus": "abaqus.yaml",
    "LS-DYNA": "dyna.yaml",
    "Ansys": "ansys.yaml",
    "OpenFOAM": "foam.yaml",
}


FOLDER = sample_files.folder("from-programs")
PAGE = (sample_files.HERE / "do" / "from-programs.md").read_text(encoding="utf-8")


def imported(name):
    """Return the scene of a description on the page, sampled every 5 µm."""
    block = rf"<!-- file: {name} -->\n```yaml\n(.*?)```"
    (FOLDER / name).write_text(re.search(block, PAGE, re.DOTALL)[1], encoding="utf-8")
    wanted = chipglow.load_import(str(FOLDER / name), ["field_of_view.spacing=5 um"])
    return chipglow.read_scene(wanted.build())


with style():
    figure = new_figure(4.2)
    figure.set_layout_engine("compressed")
    panels = figure.subplots(2, 3, sharex=True, sharey=True)
    for axes, (program, name) in zip(panels.flat, PROGRAMS.items(), strict=True):
        scene = imported(name)
        frame = scene.frame(0)
        there = frame.material == Material.WORKPIECE
        celsius = np.where(there, frame.temperature - ZERO_CELSIUS, np.nan)
        picture = show_image(axes, celsius, scene.raster, None, HEAT, (100.0, 600.0))
        axes.set_title(program)
        axes.label_outer()
        off = np.abs(celsius - 100 - 500 * np.exp(scene.raster.x / 100e-6))
        print(f"{program}: off by {np.nanmedian(off):.2f} K, {np.nanmax(off):.1f} K at most")
    figure.colorbar(picture, ax=panels, label="temperature / °C")
