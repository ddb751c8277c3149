r"""
A mesh as a scene
=================

.. image:: images/sphx_glr_meshes_001.png
   :alt: A mesh as a scene

Results of a finite-element program are sampled on a regular grid: each sample takes the value at
its centre, in a triangle by its corners' weights,

.. math:: T(x, y) = \sum_{k=1}^{3} \lambda_k(x, y)\, T_k, \qquad \sum_k \lambda_k = 1 .

What you see: PyVista's small beam of 40 hexahedra, cut with the values of its nodes and with those
of its elements, and its surface as a camera sees it. The numbers in the file are not
temperatures, but another program wrote it.

More: :doc:`/do/import-mesh`.
"""

import numpy as np
from pyvista import examples

import chipglow
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import HEAT
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene import Material

FILE = examples.hexbeamfile
SIDE = ["units.temperature=degC", "placement.horizontal=x", "placement.vertical=z"]
shown = {
    "nodes, section: 0.6 m": ("sample_point_scalars", "0.6 m"),
    "elements, section: 0.6 m": ("sample_cell_scalars", "0.6 m"),
    "nodes, section: facing": ("sample_point_scalars", "facing"),
}

with style():
    figure = new_figure(3.6)
    for axes, (title, (field, section)) in zip(figure.subplots(1, 3), shown.items(), strict=True):
        wanted = [*SIDE, f"fields.temperature={field}", f"mesh.section={section}"]
        scene = chipglow.read_scene(chipglow.load_import(FILE, wanted).build())
        frame = scene.frame(0)
        values = np.where(frame.material == Material.VOID, np.nan, frame.temperature - ZERO_CELSIUS)
        picture = axes.imshow(values, extent=scene.raster.extent, cmap=HEAT)
        axes.set_title(title, fontsize=8)
        axes.set(xlabel="x / m", ylabel="z / m")
        figure.colorbar(picture, ax=axes, shrink=0.8, label="the value in the file")
