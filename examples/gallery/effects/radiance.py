r"""
Emissivity: radiance temperature is not temperature
===================================================

.. image:: images/sphx_glr_radiance_001.png
   :alt: Emissivity: radiance temperature is not temperature

A camera measures radiance, and a chip radiates less than a blackbody does. Its *radiance
temperature* is the temperature of the blackbody with the same radiance in the camera's band. For an
emissivity :math:`\varepsilon` it is

.. math:: T_r = L^{-1}\bigl(\varepsilon L(T) + (1 - \varepsilon) L(T_\mathrm{env})\bigr),
   \qquad L(T) = \int_{\lambda_1}^{\lambda_2}
   \frac{c_{1L}\,\lambda^{-5}}{\exp(c_2 / (\lambda T)) - 1}\, \mathrm{d}\lambda .

What you see: at 700 °C the paper's chip 1 (:math:`\varepsilon = 0.42`) seems 195 K too cold, its
chip 2 (0.77) 68 K; and the same emissivity costs more in a band of longer waves.

Source: Equations 1 and 2 of Heigel and Whitenton (2010). More: :doc:`/understand/physics`.
"""

import numpy as np

import chipglow
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import BLUE, GREEN, VERMILLION
from chipglow.quantities import ZERO_CELSIUS

ENVIRONMENT = 293.0


def radiance_temperature(band, true, emissivity):
    """Return the radiance temperature of a grey surface in surroundings of 293 K, in K."""
    seen = emissivity * band.radiance(true) + (1 - emissivity) * band.radiance(ENVIRONMENT)
    return band.temperature(seen)


celsius = np.linspace(300.0, 1000.0, 141)
true = celsius + ZERO_CELSIUS
mid_wave, long_wave = chipglow.Band(3.8e-6, 5.1e-6), chipglow.Band(7.5e-6, 13e-6)

with style():
    figure = new_figure(3.0)
    left, right = figure.subplots(1, 2)
    for name, emissivity, colour in (("chip 1", 0.42, VERMILLION), ("chip 2", 0.77, BLUE)):
        error = radiance_temperature(mid_wave, true, emissivity) - true
        left.plot(celsius, error, color=colour, label=f"{name}: {emissivity}")
    left.legend(title="emissivity, 3.8 to 5.1 µm")
    bands = (("3.8 to 5.1 µm", mid_wave, VERMILLION), ("7.5 to 13 µm", long_wave, GREEN))
    for name, band, colour in bands:
        error = radiance_temperature(band, true, 0.42) - true
        right.plot(celsius, error, color=colour, label=name)
    right.legend(title="emissivity 0.42")
    for axes in (left, right):
        axes.set(xlabel="true temperature / °C", ylabel="radiance minus true temperature / K")

# %%
# The same numbers, to compare with:

for emissivity in (0.42, 0.77):
    seen = radiance_temperature(mid_wave, 700.0 + ZERO_CELSIUS, emissivity)
    print(f"emissivity {emissivity}: 700 °C is seen as {float(seen) - ZERO_CELSIUS:.1f} °C")
