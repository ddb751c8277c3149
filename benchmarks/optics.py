"""Kernels of pupils beside prysm's: the table of docs/understand/optics.md.

    python benchmarks/optics.py [--samples 512]

Prysm is optional (``pip install prysm``). Each row is the largest difference of a kernel of
81 x 81 squares of 1 um over its peak, and the times of one kernel. Closed forms are in
tests/test_pupil.py.
"""

from importlib.util import find_spec
from math import pi

import numpy as np
from common import arguments, print_head, print_row, timed

from chipglow.camera import PupilPSF
from chipglow.radiometry import Band

WAVELENGTH = 4.5e-6
LINE = Band(WAVELENGTH * (1 - 1e-7), WAVELENGTH * (1 + 1e-7))
ABERRATIONS = ((5, 0.15e-6), (8, 0.2e-6), (11, -0.15e-6))
SPACING, HALF = 1e-6, 40
PARTS = 9
PUPILS = {
    "clear": PupilPSF(LINE, 0.28),
    "obscuration 0.35": PupilPSF(LINE, 0.28, 0.35),
    "obscuration 0.35, defocus 30 um": PupilPSF(LINE, 0.28, 0.35, 30e-6),
    "obscuration 0.35, aberrations": PupilPSF(LINE, 0.28, 0.35, 0.0, ABERRATIONS),
}


def prysm_kernel(psf, samples):
    """Return prysm's kernel: a sampled pupil and a matrix Fourier transform, in mm and um."""
    from prysm.coordinates import cart_to_polar, make_xy_grid
    from prysm.geometry import circle
    from prysm.polynomials import noll_to_nm, zernike_nm
    from prysm.propagation import Wavefront

    diameter, aperture = 10.0, psf.numerical_aperture
    x, y = make_xy_grid(samples, diameter=diameter)
    radius, angle = cart_to_polar(x, y)
    radius = radius / (diameter / 2)
    open_area = circle(1.0, radius) ^ circle(psf.obscuration, radius)
    path = psf.defocus * (np.sqrt(np.maximum(1 - (aperture * radius) ** 2, 0)) - 1)
    for index, rms in psf.zernike:
        path = path + rms * zernike_nm(*noll_to_nm(index), radius, angle, norm=True)
    bent, flat = (
        Wavefront.from_amp_and_phase(open_area, 1e9 * one, 1e6 * WAVELENGTH, x[0, 1] - x[0, 0])
        for one in (path, 0 * path)
    )
    fine, count = 1e6 * SPACING / PARTS, (2 * HALF + 1) * PARTS
    length = diameter / (2 * aperture)
    image = bent.focus_fixed_sampling(length, fine, count).intensity.data
    peak = flat.focus_fixed_sampling(length, fine, 1).intensity.data
    density = pi * (1 - psf.obscuration**2) * (aperture / WAVELENGTH) ** 2 * image / peak
    parts = density[::-1].reshape(2 * HALF + 1, PARTS, 2 * HALF + 1, PARTS)
    return parts.sum(axis=(1, 3)) * (SPACING / PARTS) ** 2


def main():
    samples = arguments(__doc__, samples=512).samples
    peer = find_spec("prysm")
    if not peer:
        print("prysm is not installed")
    print_head("kernel", "difference over peak", "ms", "prysm's ms")
    for name, psf in PUPILS.items():
        kernel, own, _ = timed(lambda psf=psf: psf.kernel(SPACING))
        middle = slice(kernel.shape[0] // 2 - HALF, kernel.shape[0] // 2 + HALF + 1)
        kernel, cells = kernel[middle, middle], ("", "")
        if peer:
            found, other, _ = timed(lambda psf=psf: prysm_kernel(psf, samples))
            cells = f"{np.abs(kernel - found).max() / kernel.max():.1e}", f"{1e3 * other:.0f}"
        print_row(name, cells[0], f"{1e3 * own:.0f}", cells[1])


if __name__ == "__main__":
    main()
