r"""
A movie as a scene
==================

.. image:: images/sphx_glr_movies_001.png
   :alt: A movie as a scene

Where only a movie is left of a simulation, its colours are turned back into values: each colour
takes the place of the nearest one of the legend in CIE L*a*b*,

.. math:: T = T_\mathrm{first} + \frac{k}{n - 1}\,(T_\mathrm{last} - T_\mathrm{first}), \qquad
   |\mathbf{c} - \mathbf{c}_k| \to \min .

What you see: a picture of a movie that FFmpeg drew, the temperature that was read from it, and its
error against what FFmpeg was asked to draw. Under the mesh lines the value is taken from the
nearest pixel that shows one.

Source: the paper's own way, an AVI exported by a finite-element program. More:
:doc:`/do/import-movie`.
"""

import numpy as np
from samples.hot_spot import MOVIE, source, truth

from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import HEAT, SIGNED
from chipglow.io.sources.movies.pictures import index_movie, pictures
from chipglow.scene import FILLED, Material, Raster

movie = source()
survey = movie.survey()
print(*survey.notes.assumed, sep="\n")
left, _, _, top = survey.extent
frame = next(movie.frames(Raster(left, top, survey.spacing, 240, 250)))
temperature = np.where(frame.material == Material.TOOL, np.nan, frame.fields["temperature"])
error = temperature - truth(0)

with style():
    figure = new_figure(2.9)
    one, two, three = figure.subplots(1, 3, width_ratios=(1.15, 1, 1))
    one.imshow(next(pictures(MOVIE, index_movie(MOVIE), (0,))))
    one.set(title="picture of the movie", xlabel="pixels", ylabel="pixels")
    extent = tuple(1e3 * value for value in survey.extent)
    for axes, values, colours, limits, title in (
        (two, temperature - 273.15, HEAT, (20, 1127), "temperature / °C"),
        (three, error, SIGNED, (-20, 20), "error / K"),
    ):
        low, high = limits
        picture = axes.imshow(values, extent=extent, cmap=colours, vmin=low, vmax=high)
        axes.set(title=title, xlabel="x / mm")
        extend = "both" if low < 0 else "neither"
        figure.colorbar(picture, ax=axes, location="bottom", extend=extend, shrink=0.8)

# %%
# Where a pixel shows its own colour, and where it was filled:

for name, chosen in (("read", frame.quality != FILLED), ("filled", frame.quality == FILLED)):
    values = error[chosen & np.isfinite(error)]
    print(
        f"{name}: {values.size} pixels, {np.sqrt((values**2).mean()):.1f} K RMS, "
        f"{np.abs(values).max():.0f} K at most"
    )
