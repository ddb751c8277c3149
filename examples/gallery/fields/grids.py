"""
A grid as a scene
=================

.. image:: images/sphx_glr_grids_001.png
   :alt: A grid as a scene

Samples of the scene that are wider than the grid's are means over their area, finer ones are
interpolated.

What you see: heights of the ground near Jacksboro fault, which Matplotlib brings, on samples as
fine as the file's and on samples of 600 m. Metres stand in for kelvins here.

More: :doc:`/do/import-grid`.
"""

from matplotlib.cbook import get_sample_data

from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import VOID
from chipglow.io.sources.grids.grid import GridSource
from chipglow.scene import Raster

path = get_sample_data("jacksboro_fault_dem.npz", asfileobj=False)
source = GridSource(path, names={"temperature": "elevation"}, spacing=74.4, row_spacing=92.7)
left, right, bottom, top = source.survey().extent

with style():
    figure = new_figure(2.6)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, spacing in zip(panels, (74.4, 600.0), strict=True):
        rows, columns = int((top - bottom) / spacing), int((right - left) / spacing)
        raster = Raster(left, top, spacing, rows, columns)
        (frame,) = source.frames(raster)
        extent = tuple(1e-3 * edge for edge in raster.extent)
        picture = axes.imshow(frame.fields["temperature"], extent=extent, interpolation="nearest")
        axes.set_title(f"samples of {spacing:g} m")
        axes.set(xlabel="km", facecolor=VOID)
    panels[0].set_ylabel("km")
    figure.colorbar(picture, ax=panels, label="height / m")
