r"""
Point spread function by a knife edge
=====================================

.. image:: images/sphx_glr_knife_edge_001.png
   :alt: Point spread function by a knife edge

A blade before a blackbody is a step, and its image is the integral of how the camera spreads a
line:

.. math:: \mathrm{ESF}(s) = \int_{-\infty}^{s} \mathrm{LSF}(t)\, \mathrm{d}t, \qquad
   \mathrm{MTF}(f) = \left| \int \mathrm{LSF}(s)\, e^{-2\pi\mathrm{i} f s}\, \mathrm{d}s \right| .

An edge a few degrees off the rows shows the step at distances much finer than a pixel.

What you see: a simulated edge between 300 °C and 600 °C with the line that was found, the
edge-spread function with the fit and what it leaves, the line-spread function, and the MTF.

Source: ISO 12233; ISO 15529. More: :doc:`/do/knife-edge`.
"""

from samples.edges import edge, measured

from chipglow import AnnularAperturePSF, GaussianPSF, Measurement, edge_image, knife_edge
from chipglow.laboratory.psf.figure import sentences
from chipglow.quantities.format import uncertain_text

mirror = AnnularAperturePSF(4.45e-6)
image = measured(edge(5.0, mirror), 573.15, 873.15, 1)
found = knife_edge([edge_image(image, "knife edge")])
figure = found.plot()

# %%
# The true width, and what was found:

print(f"true {mirror.fwhm * 1e6:.3f} µm")
print("\n".join(sentences(found)))

# %%
# Use radiance, not temperature
# -----------------------------
#
# The optics add radiances. A step of temperature is another one, by Planck's law, and the width
# found from it is wrong. The true one is 10 µm:


def in_temperature(measurement):
    """Return the same image with temperature instead of radiance: a mistake to avoid."""
    wrong = measurement.data.copy(deep=True)
    wrong["radiance"].values[:] = wrong["radiance_temperature"].values
    return Measurement(wrong)


def width(of):
    """Return the width of the Gaussian."""
    fit = of.fit("gaussian")
    text = uncertain_text(fit.fwhm * 1e6, fit.fwhm_uncertainty * 1e6)
    return f"{text} µm (reduced chi-squared {fit.reduced_chi_squared:.1f})"


gauss = measured(edge(5.0, GaussianPSF(10e-6)), 573.15, 873.15, 2)
print("by radiance:", width(knife_edge([edge_image(gauss, "radiance")])))
print("by temperature:", width(knife_edge([edge_image(in_temperature(gauss), "temperature")])))
