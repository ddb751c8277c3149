"""Transfer and point spread functions of docs/understand/optics.md beside closed forms and others.

python benchmarks/optics.py [--samples 512]

The peers are optional; ``pip install pybsm prysm`` has them. Each row is the
greatest difference of a transfer function, or that of a point spread function over its peak, and
the time of one kernel.
"""

import argparse
from importlib.util import find_spec
from math import pi, sqrt
from time import perf_counter

import numpy as np
from scipy.special import j0

from chipglow.camera import Jitter, LinearMotion, PupilPSF, Vibration
from chipglow.camera.optics.pupil import annular_transfer
from chipglow.radiometry import Band

WAVELENGTH = 4.5e-6
LINE = Band(WAVELENGTH * (1 - 1e-7), WAVELENGTH * (1 + 1e-7))
FOCAL_LENGTH = 0.1
ABERRATIONS = ((5, 0.15e-6), (8, 0.2e-6), (11, -0.15e-6))
SPACING, HALF = 1e-6, 40
PARTS = 9


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=512, help="of prysm's pupil, across")
    samples = parser.parse_args().samples
    peers = {name: find_spec(name) is not None for name in ("pybsm", "prysm")}
    for name, there in peers.items():
        if not there:
            print(f"{name} is not installed")
    print("| case | closed form | pyBSM | prysm | ms | prysm's ms |")
    print("|---|---|---|---|---|---|")
    for name, ours, exact, theirs in transfers(peers["pybsm"]):
        apart = [None if other is None else np.abs(ours - other).max() for other in (exact, theirs)]
        row(name, *apart, None, None, None)
    for name, psf in spreads():
        kernel, own = timed(lambda psf=psf: psf.kernel(SPACING))
        middle = slice(kernel.shape[0] // 2 - HALF, kernel.shape[0] // 2 + HALF + 1)
        kernel, exact = kernel[middle, middle], hankel(psf)
        apart, other = None, None
        if peers["prysm"]:
            found, other = timed(lambda psf=psf: prysm_kernel(psf, samples))
            apart = np.abs(kernel - found).max() / kernel.max()
        closed = None if exact is None else np.abs(kernel - exact).max() / kernel.max()
        row(name, closed, None, apart, own, other)


def row(name, closed, pybsm, prysm, own, other):
    """Print a row."""
    differences = ["" if one is None else f"{one:.1e}" for one in (closed, pybsm, prysm)]
    times = ["" if one is None else f"{1e3 * one:.0f}" for one in (own, other)]
    print("| " + " | ".join([name, *differences, *times]) + " |", flush=True)


def timed(compute):
    """Result and time in s."""
    start = perf_counter()
    result = compute()
    return result, perf_counter() - start


def transfers(pybsm):
    """Name, our transfer function, the closed form and pyBSM's, on frequencies of both signs."""
    aperture = 0.05
    cutoff = 2 * aperture / WAVELENGTH
    # None where pyBSM's annulus has its kinks: rounding decides there.
    line = np.linspace(-1.03, 1.03, 84) * cutoff
    across, up = np.meshgrid(line, line)
    diameter = 2 * aperture * FOCAL_LENGTH
    theirs = _PyBSM(across, up, diameter) if pybsm else None
    for obscuration in (0.0, 0.35):
        ours = PupilPSF(LINE, aperture, obscuration).transfer(across, up)
        exact = annular_transfer(np.hypot(across, up) / cutoff, obscuration)
        yield f"OTF, obscuration {obscuration}", ours, exact, theirs and theirs.pupil(obscuration)
    for defocus in (0.5e-3, 2e-3):
        ours = PupilPSF(LINE, aperture, 0.0, defocus).transfer(across, up)
        exact = hopkins(np.hypot(across, up) / cutoff, defocus * (1 - sqrt(1 - aperture**2)))
        yield f"OTF, defocus {1e3 * defocus} mm", ours, exact, theirs and theirs.defocus(defocus)
    length = 20e-6
    yield (
        "OTF, jitter",
        Jitter(length).transfer(across, up),
        np.exp(-2 * (pi * length) ** 2 * (across**2 + up**2)),
        theirs and theirs.jitter(length),
    )
    yield (
        "OTF, linear motion",
        LinearMotion(length, pi / 2).transfer(across, up),
        np.sinc(length * up),
        theirs and theirs.drift(length),
    )
    yield (
        "OTF, vibration",
        Vibration(length, 0.0).transfer(across, up),
        np.mean(
            [np.cos(2 * pi * across * length * np.sin(a)) for a in pi * np.arange(64) / 64], axis=0
        ),
        None,
    )


class _PyBSM:
    """pyBSM's functions of angular frequency, on ours."""

    def __init__(self, across, up, diameter):
        self.u, self.v = across * FOCAL_LENGTH, up * FOCAL_LENGTH
        self.diameter = diameter

    def pupil(self, obscuration):
        from pybsm.otf.functional import circular_aperture_OTF

        return circular_aperture_OTF(
            u=self.u, v=self.v, lambda0=WAVELENGTH, D=self.diameter, eta=obscuration
        )

    def defocus(self, defocus):
        from pybsm.otf.functional import circular_aperture_OTF_with_defocus

        return circular_aperture_OTF_with_defocus(
            u=self.u,
            v=self.v,
            wavelength=WAVELENGTH,
            D=self.diameter,
            f=FOCAL_LENGTH,
            defocus=defocus,
        )

    def jitter(self, length):
        from pybsm.otf.functional import jitter_OTF

        angle = length / FOCAL_LENGTH
        return jitter_OTF(u=self.u, v=self.v, s_x=angle, s_y=angle)

    def drift(self, length):
        from pybsm.otf.functional import drift_OTF

        return drift_OTF(u=self.u, v=self.v, a_x=0.0, a_y=length / FOCAL_LENGTH)


def hopkins(nu, path):
    """Transfer function of a clear pupil out of focus, by quadrature of the overlap's area.

    Hopkins, Proc. R. Soc. A 231 (1955) 91, with the path difference at the edge in m.
    """
    node, weight = np.polynomial.legendre.leggauss(200)
    found = np.zeros(nu.shape)
    inside = nu < 1
    s = nu[inside][:, None]
    # The overlap of discs 2 s apart: |y| to sqrt(1 - (|x| + s)²) for |x| up to 1 - s.
    # x = (1 - s) (1 - t²) leaves no root at its end.
    t = (node + 1) / 2
    x = (1 - s) * (1 - t**2)
    height = np.sqrt(np.maximum(1 - (x + s) ** 2, 0.0))
    phase = 2 * pi / WAVELENGTH * path * 4 * s * x
    found[inside] = (4 * height * np.cos(phase) * (1 - s) * 2 * t * weight / 2).sum(axis=1) / pi
    return found


def spreads():
    """Names and point spread functions."""
    yield "PSF, clear", PupilPSF(LINE, 0.28)
    yield "PSF, obscuration 0.35", PupilPSF(LINE, 0.28, 0.35)
    yield "PSF, defocus 30 um", PupilPSF(LINE, 0.28, 0.35, 30e-6)
    yield "PSF, aberrations", PupilPSF(LINE, 0.28, 0.35, 0.0, ABERRATIONS)


def hankel(psf):
    """Kernel of a pupil that is round, by Hankel's transform; None for another."""
    if psf.zernike:
        return None
    aperture, inner = psf.numerical_aperture, psf.obscuration
    node, weight = np.polynomial.legendre.leggauss(200)
    rho = inner + (1 - inner) * (node + 1) / 2
    path = psf.defocus * (np.sqrt(1 - (aperture * rho) ** 2) - 1)
    wave = np.exp(2j * pi * path / WAVELENGTH) * rho * weight * (1 - inner) / 2
    radius = np.linspace(0, 1.5 * (HALF + 1) * SPACING, 3000)
    amplitude = 2 * pi * j0(2 * pi * aperture / WAVELENGTH * np.outer(radius, rho)) @ wave
    density = np.abs(amplitude) ** 2 * (aperture / WAVELENGTH) ** 2 / (pi * (1 - inner**2))
    return squares(lambda x, y: np.interp(np.hypot(x, y), radius, density))


def squares(density):
    """Integrals over squares, by the midpoints of 81 parts of each."""
    fine = SPACING / PARTS
    count = (2 * HALF + 1) * PARTS
    place = fine * (np.arange(count) - (count - 1) / 2)
    values = density(place, place[::-1, None]) * fine**2
    return values.reshape(2 * HALF + 1, PARTS, 2 * HALF + 1, PARTS).sum(axis=(1, 3))


def prysm_kernel(psf, samples):
    """The same of prysm: a sampled pupil and a matrix Fourier transform, lengths in mm and um."""
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


if __name__ == "__main__":
    main()
