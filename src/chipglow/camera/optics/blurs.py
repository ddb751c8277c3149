"""Blurs in addition to the optics: charge diffusion and camera motion."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from math import ceil, cos, pi, sin
from typing import Annotated, Final

import numpy as np
from scipy import fft
from scipy.special import j0

from chipglow.camera.optics.kernel import folded, half_size, kernel_fwhm, normalised, resized
from chipglow.camera.optics.psf import PointSpreadFunction
from chipglow.quantities import Array, Family, Parameter, Part
from chipglow.quantities.units import ANGLE, LENGTH
from chipglow.radiometry import Band

BLURS: Final = Family("blur")
"""Blurs by kind; other packages register theirs in the group ``chipglow.blur``."""

_SQUARES_PER_WIDTH: Final = 4
"""Minimum number of squares across the width of a point spread function."""

_NEAR: Final = 32
"""Range of a blur's change in widths of the point spread function."""

_WIDTH_SQUARES: Final = 24
"""Squares along the width of a point spread function for the width of its blur."""


class BlurTerm(Part, ABC):
    """A shift-invariant blur; lengths are on the scene."""

    @property
    @abstractmethod
    def reach(self) -> float:
        """Largest displacement of light in m."""

    @abstractmethod
    def transfer(self, across: Array, up: Array) -> Array:
        """Return the transfer function at frequencies to the right and up in 1/m, broadcast.

        It is 1 at zero frequency.
        """


Deviation = Annotated[float, Parameter("Standard deviation along each axis, on the scene.", LENGTH)]
Direction = Annotated[
    float, Parameter("Direction, counter-clockwise from the right.", ANGLE, least=-pi, most=pi)
]


@dataclass(frozen=True)
class _RandomBlur(BlurTerm):
    """Normally distributed displacements with the transfer function exp(−2π² σ² f²)."""

    standard_deviation: Deviation

    @property
    def reach(self) -> float:
        """Eight standard deviations, beyond which 1e-15 of the light falls."""
        return 8 * self.standard_deviation

    def transfer(self, across: Array, up: Array) -> Array:
        return np.asarray(np.exp(-2 * (pi * self.standard_deviation) ** 2 * (across**2 + up**2)))


@BLURS.part
@dataclass(frozen=True)
class ChargeDiffusion(_RandomBlur):
    """Diffusion of charge into neighbouring detector elements before it is collected."""

    kind = "charge-diffusion"
    example = "{kind: charge-diffusion, standard_deviation: 1.5 um}"


@BLURS.part
@dataclass(frozen=True)
class Jitter(_RandomBlur):
    """Random vibration with many periods within the integration time."""

    kind = "jitter"
    example = "{kind: jitter, standard_deviation: 1 um}"


@BLURS.part
@dataclass(frozen=True)
class LinearMotion(BlurTerm):
    """Uniform motion between camera and scene during the integration time."""

    kind = "linear-motion"
    example = "{kind: linear-motion, distance: 4 um, direction: 0 deg}"
    distance: Annotated[float, Parameter("Path during the integration time, on the scene.", LENGTH)]
    direction: Direction = 0.0

    @property
    def reach(self) -> float:
        return self.distance / 2

    def transfer(self, across: Array, up: Array) -> Array:
        return np.asarray(np.sinc(self.distance * _along(self.direction, across, up)))


@BLURS.part
@dataclass(frozen=True)
class Vibration(BlurTerm):
    """Sinusoidal vibration along a line with many periods within the integration time."""

    kind = "vibration"
    example = "{kind: vibration, amplitude: 2 um, direction: 90 deg}"
    amplitude: Annotated[
        float, Parameter("Largest displacement from the centre, on the scene.", LENGTH)
    ]
    direction: Direction = 0.0

    @property
    def reach(self) -> float:
        return self.amplitude

    def transfer(self, across: Array, up: Array) -> Array:
        along = _along(self.direction, across, up)
        return np.asarray(j0(2 * pi * self.amplitude * along))


def _along(direction: float, across: Array, up: Array) -> Array:
    """Return the frequency along a direction in 1/m."""
    return across * cos(direction) + up * sin(direction)


@dataclass(frozen=True)
class BlurredPSF(PointSpreadFunction):
    """A point spread function with further blurs, whose transfer functions are multiplied.

    Parameters
    ----------
    psf : PointSpreadFunction
        Blur of the optics, or a measured one.
    blurs : tuple of BlurTerm
        Further blurs; a ValueError if the point spread function includes one already.

    Notes
    -----
    `fwhm` is the mean of the widths along the row and the column through the peak. The change due
    to the blurs is computed within 32 widths plus the reach of the blurs, on squares of at most a
    quarter of the width, and summed over the requested squares. Farther out, at a radius r, a blur
    of standard deviation σ changes the light by a fraction of about (σ / r)², which is neglected.
    The total light is conserved.
    """

    psf: PointSpreadFunction
    blurs: tuple[BlurTerm, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        for one in self.blurs:
            if one.kind in self.psf.includes:
                raise ValueError(
                    f"blur: the point spread function already includes {one.kind}; remove it here"
                )

    def __str__(self) -> str:
        return " and ".join([str(self.psf), *(one.kind for one in self.blurs)])

    @property
    def includes(self) -> tuple[str, ...]:  # type: ignore[override]
        """Kinds of effects in addition to the optics."""
        return (*self.psf.includes, *(one.kind for one in self.blurs))

    @cached_property
    def fwhm(self) -> float:  # type: ignore[override]
        """Full width at half maximum in m."""
        spacing = self.psf.fwhm / _WIDTH_SQUARES
        half = ceil((self.psf.fwhm + self._reach) / spacing)
        kernel = self.view_kernel(spacing, half, half)
        kernel = kernel[1:-1, 1:-1]  # the border squares contain the light beyond
        return kernel_fwhm(kernel, spacing)

    def in_band(self, band: Band) -> "BlurredPSF":
        return replace(self, psf=self.psf.in_band(band))

    def kernel(self, spacing: float) -> Array:
        kernel, change = self.psf.kernel(spacing), self._change(spacing)
        half = max(kernel.shape[0], change.shape[0]) // 2
        return np.maximum(resized(kernel, half, half) + resized(change, half, half), 0.0)

    def view_kernel(self, spacing: float, rows: int, columns: int) -> Array:
        kernel = self.psf.view_kernel(spacing, rows, columns)
        change = folded(self._change(spacing), rows, columns)
        rows, columns = (max(pair) // 2 for pair in zip(kernel.shape, change.shape, strict=True))
        sum_of_both = resized(kernel, rows, columns) + resized(change, rows, columns)
        return normalised(np.maximum(sum_of_both, 0.0))

    def _change(self, spacing: float) -> Array:
        """Return the change of the fractions due to the blurs, of sum 0."""
        half = half_size(_NEAR * self.psf.fwhm + self._reach, spacing)
        parts = 1 + 2 * ceil(max(_SQUARES_PER_WIDTH * spacing / self.psf.fwhm - 1, 0) / 2)
        fine = spacing / parts
        reach = half * parts + parts // 2
        half_size(reach * fine, fine)
        # The border squares contain the light beyond and are cut off.
        kernel = resized(self.psf.view_kernel(fine, reach + 1, reach + 1), reach, reach)
        frequency = fft.fftfreq(kernel.shape[0], fine)
        # Rows go down, frequencies go up.
        change = self.transfer(frequency[: kernel.shape[0] // 2 + 1], -frequency[:, None]) - 1.0
        blurred = fft.irfft2(fft.rfft2(kernel) * change, s=kernel.shape)
        count = 2 * half + 1
        return np.asarray(blurred.reshape(count, parts, count, parts).sum(axis=(1, 3)))

    def transfer(self, across: Array, up: Array) -> Array:
        """Return the transfer function of the blurs alone; see `BlurTerm`."""
        return reduce(np.multiply, (one.transfer(across, up) for one in self.blurs))

    @property
    def _reach(self) -> float:
        return sum(one.reach for one in self.blurs)
