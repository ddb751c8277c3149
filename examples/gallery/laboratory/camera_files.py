r"""
Files of cameras
================

.. image:: images/sphx_glr_camera_files_001.png
   :alt: Files of cameras

A recording has counts, times, and what the camera knew: its constants, the object parameters that
its operator set, the exposure. A FLIR camera's own constants turn its counts into the temperature
of a blackbody,

.. math:: T = \frac{B}{\ln\left(\frac{R_1}{R_2\,(S + O)} + F\right)} .

What you see: left, a simulated chip in a file of Telops' format, as counts; right, a frame of a
real FLIR T420 through its own constants.

Source: the layouts and their tests are described on :doc:`/do/camera-files`.
"""

import lzma
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import sample_files

import chipglow
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import HEAT, PLAIN
from chipglow.quantities import ZERO_CELSIUS

simulated = chipglow.read_recording(sample_files.folder("camera-files") / "chip.hcc")

# %%
# The real frame is one of the tests' files; flirpy brings it.

with TemporaryDirectory() as folder:
    path = Path(folder) / "t420.fff"
    packed = sample_files.HERE.parent / "tests" / "reference" / "flir" / "t420.fff.xz"
    path.write_bytes(lzma.decompress(packed.read_bytes()))
    real = chipglow.read_recording(path)
celsius = real.conversion.temperature(real.signal[0]) - ZERO_CELSIUS

with style():
    figure = new_figure(2.6)
    left, right = figure.subplots(1, 2, width_ratios=(1.05, 1.0))
    left.set_title(f"HCC, simulated: {simulated.times[2] * 1e3:.2f} ms")
    right.set_title("FFF, a FLIR T420")
    for axes, values, colours, unit in (
        (left, simulated.signal[2], PLAIN, "counts"),
        (right, celsius, HEAT, "°C, of a blackbody"),
    ):
        picture = axes.imshow(values, cmap=colours, vmax=np.percentile(values, 99.9))
        axes.set(xlabel="column", ylabel="row")
        figure.colorbar(picture, ax=axes, label=unit, fraction=0.036)

# %%
# The camera's settings for the object, and the assumptions:

print(real.object_parameters)
print(*simulated.notes.assumed, *real.notes.assumed, sep="\n")
