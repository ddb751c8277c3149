r"""
Measured and simulated
======================

.. image:: images/sphx_glr_compare_001.png
   :alt: Measured and simulated

Which emissivities describe the chip? Differences at the rake face and along the shear band are
judged by their uncertainties,

.. math:: E_n = \frac{|T_\mathrm{simulated} - T_\mathrm{measured}|}
   {\sqrt{U_\mathrm{measured}^2 + U_\mathrm{simulated}^2}} ,

and up to 1 the two agree.

What you see: an "experiment" whose emissivities lie between those of the paper's two chips, with
noise and a calibration that is 0.4 % off, next to simulations with either set.

Source: ISO/IEC 17043 (:math:`E_n`); Figures 7 to 9 of Heigel and Whitenton (2010). More:
:doc:`/do/compare`.
"""

import sample_files

import chipglow
from chipglow.laboratory.comparison import StatedUncertainties

files = sample_files.folder("compare")
measured = chipglow.read_measurement(files / "measured.nc")
simulated = {
    name: chipglow.read_measurement(files / f"{name.replace(' ', '-')}.nc")
    for name in ("chip 1", "chip 2")
}
result = chipglow.compare(
    measured, simulated, measured.tool, stated=StatedUncertainties(emissivity=0.05)
)
figure = result.plot()

# %%
# The sentences that ``chipglow compare`` prints:

for text in (*result.sentences, result.statement, *result.notes.warnings):
    print(text)
