"""The image of a surface in GalSim, for `camera_pass.py`.

Samples are squares of one surface brightness ("nearest"), the point spread function is GalSim's own
Gaussian, and pixels are those of `drawImage`. Beyond the samples GalSim takes nothing to be. Its
accuracies and the size of its transforms are its defaults.
"""

import galsim


def prepared(_kernel, fwhm, spacing, group):
    """What forms an image: surface brightness of squares to that of `group` times larger ones."""
    pitch = group * spacing

    def form(radiance):
        rows, columns = radiance.shape
        scene = galsim.InterpolatedImage(
            galsim.Image(radiance, scale=spacing),
            x_interpolant="nearest",
            normalization="sb",
            calculate_stepk=False,
            calculate_maxk=False,
        )
        seen = galsim.Convolve(scene, galsim.Gaussian(fwhm=fwhm))
        image = seen.drawImage(nx=columns // group, ny=rows // group, scale=pitch, dtype=float)
        return image.array / pitch**2

    return form
