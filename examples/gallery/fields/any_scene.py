"""
The error without a cut
=======================

.. image:: images/sphx_glr_any_scene_001.png
   :alt: The error without a cut

A scene needs a temperature and nothing else. A melt pool of laser powder-bed fusion, an adiabatic
shear band in a Kolsky bar, and a brake disc from a movie are looked at by three cameras.

What you see: for each of them the error that its camera makes. Where the hot spot is narrower than
what a detector element sees, the highest temperature is lost.

Source: Rosenthal's moving point source for the pool; the bar is about as Marchand and Duffy (1988)
found it in HY-100 steel. More, with every file and command: :doc:`/do/any-scene`.
"""

import re
from pathlib import Path
from tempfile import TemporaryDirectory

import sample_files

import chipglow
from chipglow.drawing.drawing import style
from chipglow.report.facts import Facts
from chipglow.report.figures import error_images, error_lines
from chipglow.study import errors

# %%
# The studies stand on the page: each states surface, camera and places.

files = sample_files.folder("any-scene")
page = (sample_files.HERE / "do" / "any-scene.md").read_text(encoding="utf-8")
for name, text in re.findall(r"<!-- file: (\S+) -->\n```yaml\n(.*?)```", page, re.DOTALL):
    (files / name).write_text(text, encoding="utf-8")


def looked_at(source, settings, study):
    """Return the errors of a study on fields that are imported."""
    with TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.nc"
        chipglow.import_scene(chipglow.load_import(str(files / source), settings).build(), scene)
        return Facts(errors(chipglow.load_study(files / study, scene)))


# %%
# Eight frames of a melt pool from above, 5 µs apart, and a camera of InGaAs:

pool = looked_at(
    "pool_*.vtu", ["units.length=um", "interval=5 us", "field_of_view.spacing=2 um"], "pool.yaml"
)
with style():
    figure = error_images(pool)

# %%
# Across a shear band that narrows from 200 µm to 30 µm while it heats:

bar = looked_at("bar.npz", ["interval=1 us", "grid.spacing=2 um", "grid.top=150 um"], "bar.yaml")
with style():
    across = error_lines(bar)

# %%
# A brake disc with hot spots, of which there is a movie only:

disc = looked_at("disc.yaml", [], "look.yaml")
with style():
    spots = error_images(disc)
