"""Kernels of pupils beside prysm's: the table of docs/understand/optics.md.

    python benchmarks/optics.py [--samples 512]

Prysm is optional (``pip install prysm``). Each row is the greatest difference of a kernel of
81 x 81 squares of 1 um over its peak, and the times of one kernel. Closed forms are in
tests/test_pupil.py.
"""

import argparse
from importlib.util import find_spec
from math import pi
from time import perf_counter

import numpy as np

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


def timed(compute):
    """Return the result and the time in ms."""
    start = perf_counter()
    result = compute()
    return result, 1e3 * (perf_counter() - start)


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
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=512, help="of prysm's pupil, across")
    samples = parser.parse_args().samples
    peer = find_spec("prysm") is not None
    if not peer:
        print("prysm is not installed")
    print("| kernel | difference over peak | ms | prysm's ms |\n|---|---|---|---|")
    for name, psf in PUPILS.items():
        kernel, own = timed(lambda psf=psf: psf.kernel(SPACING))
        middle = slice(kernel.shape[0] // 2 - HALF, kernel.shape[0] // 2 + HALF + 1)
        kernel, cells = kernel[middle, middle], ("", "")
        if peer:
            found, other = timed(lambda psf=psf: prysm_kernel(psf, samples))
            cells = f"{np.abs(kernel - found).max() / kernel.max():.1e}", f"{other:.0f}"
        print(f"| {name} | {cells[0]} | {own:.0f} | {cells[1]} |", flush=True)


if __name__ == "__main__":
    main()
