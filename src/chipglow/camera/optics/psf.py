"""Point spread functions of an infrared camera."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from errno import ENOENT
from functools import cached_property
from math import ceil, inf, log, pi, sqrt
from pathlib import Path
from typing import Annotated, Final

import numpy as np
import scipy
import xarray as xr
from numpy.typing import ArrayLike
from scipy.special import erf, erfinv, j1

from chipglow.camera.optics.kernel import (
    check_length,
    folded,
    half_size,
    kernel_fwhm,
    light_on_squares,
    normalised,
)
from chipglow.camera.optics.sampling import overlap_lengths
from chipglow.quantities import Array, Family, FileBeside, Parameter, Part
from chipglow.quantities.units import LENGTH, WAVELENGTH
from chipglow.radiometry import Band
from chipglow.text import check_own_data
from chipglow.uncertainty import Component, Estimate, from_xarray

GAUSSIAN_ENERGY: Final = 1.0 - 1e-12
"""Fraction of a Gaussian's light that its kernel holds: all but rounding.

With 0.9999 a surface at 573 K beside one at 1300 K lacked, in a band of 1.0 to 1.7 um, all of the
light that it gets from there: the hot one sends 10 000 times as much.
"""

ANNULAR_ENERGY: Final = 0.99
"""The same for diffraction, whose light beyond a radius r falls only as 1/r.

The camera's blur has no use for it: `PointSpreadFunction.view_kernel` leaves out nothing.
"""

FWHM_PER_SIGMA: Final = 2 * sqrt(2 * log(2))
"""Full width at half maximum of a Gaussian over its standard deviation."""

_FAR: Final = 30.0
"""Radius, as v, from which on the mean of diffraction's rings falls as 1/r³: within 2 %."""


PSFS: Final = Family("psf")
"""Point spread functions by their kind; other packages add theirs in the group ``chipglow.psf``."""


DiffractionWavelength = Annotated[
    float | None,
    Parameter(
        "Wavelength of the diffraction; none: the middle of the camera's band.",
        WAVELENGTH,
        over=0.0,
        most=0.1,
    ),
]


class PSFChoice(Part, ABC):
    """A description's choice of a camera's point spread function."""

    @abstractmethod
    def for_camera(self, band: Band, magnification: float | None) -> "PointSpreadFunction":
        """Return the point spread function on the scene, by the band and the lens's magnification.

        A ValueError if that is not possible, such as without a magnification where it is needed.
        """


class PointSpreadFunction(PSFChoice):
    """Distribution of a point's light over the scene's plane, `fwhm` m wide at half maximum.

    `includes` are effects in it besides the optics: ``footprint`` for the pixel's sensitive square,
    or kinds of `chipglow.camera.BLURS`. A camera adds none of them again.
    """

    fwhm: float
    includes: tuple[str, ...] = ()

    def for_camera(self, band: Band, magnification: float | None) -> "PointSpreadFunction":
        """Return itself: it is given on the scene."""
        return self

    def in_band(self, band: Band) -> "PointSpreadFunction":
        """Return that of the same optics in another band; itself where it is not by diffraction."""
        return self

    @abstractmethod
    def kernel(self, spacing: float) -> Array:
        """Return the fractions of a point's light on a grid of squares.

        Parameters
        ----------
        spacing : float
            Side of a square in m. The point is in the middle of the middle square.

        Returns
        -------
        ndarray
            A square array of odd side, first row on top. What its sum lacks of 1 falls outside:
            `GAUSSIAN_ENERGY`, `ANNULAR_ENERGY`.
        """

    def view_kernel(self, spacing: float, rows: int, columns: int) -> Array:
        """Return the fractions of a point's light in a view, of which none is left out.

        Parameters
        ----------
        spacing : float
            Side of a square in m. The point is in the middle of the middle square.
        rows, columns : int
            Squares up and down from the middle one, and to either side.

        Returns
        -------
        ndarray
            Of sum 1, shape (2 m + 1, 2 n + 1) with up to `rows` and `columns`. The outermost
            squares hold, besides their own, the light that goes farther in their direction.
        """
        return folded(normalised(self.kernel(spacing)), rows, columns)


@PSFS.part
@dataclass(frozen=True)
class AnnularAperturePSF(PointSpreadFunction):
    """Diffraction of a reflecting microscope objective.

    Its pupil is round with a central round obstruction. The closed form, with v = 2π NA r / λ
    and the obscuration o, is [2 J1(v)/v − o² 2 J1(ov)/(ov)]² / (1 − o²)² (Born and Wolf, Principles
    of Optics, 8.6.2). It holds no aberration and nothing of the detector. `fwhm` is its full width
    at half maximum in m.

    The paper prints the point spread function of its camera as a picture only (Figure 2). The
    default values are an assumption: those usual for a reflecting (Schwarzschild) microscope
    objective of 15 times.
    """

    kind = "annular-aperture"
    example = "{kind: annular-aperture, numerical_aperture: 0.28}"
    wavelength: DiffractionWavelength = 4.5e-6
    numerical_aperture: Annotated[
        float, Parameter("Numerical aperture of the objective.", over=0.0, most=1.0)
    ] = 0.28
    obscuration: Annotated[
        float, Parameter("Diameter of the central obstruction, as a fraction.", least=0.0, most=0.9)
    ] = 0.35

    def __str__(self) -> str:
        of = f", obscured to {self.obscuration:g} of its diameter" if self.obscuration else ""
        at = "" if self.wavelength is None else f", at {self.wavelength * 1e6:g} µm"
        return f"diffraction of a round pupil of NA {self.numerical_aperture:.3g}{of}{at}"

    @cached_property
    def fwhm(self) -> float:  # type: ignore[override]
        half = scipy.optimize.brentq(lambda v: float(self._profile(np.array(v))) - 0.5, 0.1, 3.0)
        return 2 * float(half) * self._unit

    def for_camera(self, band: Band, magnification: float | None) -> "AnnularAperturePSF":
        return self if self.wavelength is not None else self.in_band(band)

    def in_band(self, band: Band) -> "AnnularAperturePSF":
        """Return the diffraction at the band's middle wavelength."""
        return replace(self, wavelength=(band.lower + band.upper) / 2)

    def kernel(self, spacing: float) -> Array:
        half = half_size(self._reach * self._unit, spacing)
        return self._fractions(spacing, half, half)

    def view_kernel(self, spacing: float, rows: int, columns: int) -> Array:
        check_length("spacing", spacing)
        far = ceil(_FAR * self._unit / spacing)
        kernel = self._fractions(spacing, max(rows, far), max(columns, far))
        return folded(_with_the_rest(kernel, spacing), rows, columns)

    def _fractions(self, spacing: float, rows: int, columns: int) -> Array:
        """Return fractions of the light on squares around the centre."""
        # Gauss nodes: two, and three more for every ring (π in v) that a square spans.
        count = 2 + ceil(3 * spacing / (pi * self._unit))
        side = spacing / self._unit
        quadrant = light_on_squares(self._amplitude, side, rows, columns, count)
        # The integral of the profile over the plane is 4π / (1 − o²), by Parseval.
        quadrant *= (1 - self.obscuration**2) / (4 * pi)
        return np.pad(quadrant, ((rows, 0), (columns, 0)), mode="reflect")

    @property
    def _unit(self) -> float:
        """Radius in m where v is 1."""
        if self.wavelength is None:
            raise ValueError("psf: wavelength is none, expected it or a camera with a band")
        return self.wavelength / (2 * pi * self.numerical_aperture)

    @property
    def _reach(self) -> float:
        """Radius, as v, that encircles `ANNULAR_ENERGY`."""
        # Beyond the rings' first few, the fraction outside is 2 / (π v (1 − o)).
        far = 4 / (pi * (1 - self.obscuration) * (1 - ANNULAR_ENERGY))
        v = np.linspace(0.0, far, ceil(20 * far))
        clear = 1 - self.obscuration**2
        inside = scipy.integrate.cumulative_simpson(
            clear / 2 * self._profile(v) * v, x=v, initial=0.0
        )
        return float(v[np.searchsorted(inside, ANNULAR_ENERGY)])

    def _profile(self, v: Array) -> Array:
        """Return the irradiance over that in the middle."""
        return self._amplitude(v) ** 2

    def _amplitude(self, v: Array) -> Array:
        inner = self.obscuration**2
        return np.asarray((_jinc(v) - inner * _jinc(self.obscuration * v)) / (1 - inner))


@PSFS.part
@dataclass(frozen=True)
class GaussianPSF(PointSpreadFunction):
    """A round Gaussian."""

    kind = "gaussian"
    example = "{kind: gaussian, fwhm: 12 um}"
    fwhm: Annotated[float, Parameter("Full width at half maximum.", LENGTH, over=0.0, most=0.1)]

    def __str__(self) -> str:
        return f"a Gaussian {self.fwhm * 1e6:.3g} µm wide at half maximum"

    def kernel(self, spacing: float) -> Array:
        deviation = self.fwhm / FWHM_PER_SIGMA
        reach = sqrt(2) * deviation * float(erfinv(sqrt(GAUSSIAN_ENERGY)))
        half = half_size(reach, spacing)
        edges = spacing * (np.arange(-half, half + 2) - 0.5)
        line = np.diff(erf(edges / (sqrt(2) * deviation))) / 2
        return np.outer(line, line)


@dataclass(frozen=True, eq=False)
class MeasuredPSF(PointSpreadFunction):
    """A measured kernel, such as one found with a knife edge.

    Parameters
    ----------
    weights : array_like
        Fraction of a point's light on each square of a grid, in any unit; a square array of odd
        side, first row on top, the point in the middle of the middle square.
    spacing : float
        Side of those squares in m, on the scene.
    components : tuple of Component
        What independent errors change in the weights, in their unit; those of ``chipglow psf`` are
        in its files. None by default: then nothing is known of them.
    includes : tuple of str
        Effects in it besides the optics, because it was measured through them: ``footprint`` for
        the pixel's sensitive square, and kinds of `chipglow.camera.BLURS`.

    Notes
    -----
    Its `fwhm` is the mean of the widths along the row and the column through the greatest value; of
    equal ones, through the one nearest to the middle of them all. At another spacing the light is
    taken as even within each measured square and shared among the new squares by area. The weights
    are scaled to a sum of 1: what the measurement did not reach is not there.
    """

    weights: Array = field(repr=False)
    spacing: float
    components: tuple[Component, ...] = field(default=(), repr=False)
    includes: tuple[str, ...] = ()
    fwhm: float = field(init=False)

    def __str__(self) -> str:
        rows, columns = self.weights.shape
        return f"measured, {rows} x {columns} values {self.spacing * 1e6:.3g} µm apart"

    def __post_init__(self) -> None:
        check_length("spacing", self.spacing)
        given = Estimate(_checked_weights(self.weights), self.components)
        estimate = given / given.sum()
        object.__setattr__(self, "weights", estimate.values)
        object.__setattr__(self, "components", estimate.components)
        object.__setattr__(self, "fwhm", kernel_fwhm(estimate.values, self.spacing))

    @property
    def estimate(self) -> Estimate:
        """`weights` with `components`."""
        return Estimate(self.weights, self.components)

    @classmethod
    def from_file(
        cls, path: str | Path, spacing: float | None = None, includes: tuple[str, ...] | None = None
    ) -> "MeasuredPSF":
        """Read a kernel from a NumPy array (``.npy``), a table (``.csv``) or a NetCDF file.

        A ``.nc`` is of ``chipglow psf``. `spacing` is the side of its squares in m on the scene,
        None for a ``.nc``, which states it; `includes` are by default those that a ``.nc`` states.
        A ValueError names the file if it holds no kernel.
        """
        path = Path(path)
        kind = path.suffix.lower()
        if kind not in (".npy", ".csv", ".nc"):
            raise ValueError(f"psf: {path} is of kind {path.suffix!r}, expected .npy, .csv or .nc")
        if (spacing is None) != (kind == ".nc"):
            raise ValueError(
                f"psf: spacing is {spacing!r} for {path}, expected "
                + ("none: the file states it" if kind == ".nc" else "a length such as 1e-6 m")
            )
        try:
            if spacing is None:
                estimate, spacing, stated = _read_netcdf(path)
                held = stated if includes is None else includes
                return cls(estimate.values, spacing, estimate.components, held)
            return cls(_read_array(path), spacing, includes=includes or ())
        except (ValueError, EOFError, MemoryError, KeyError, RuntimeError) as error:
            raise ValueError(f"psf: {path} is not a kernel: {error}") from error

    def kernel(self, spacing: float) -> Array:
        samples = self.weights.shape[0]
        width = samples * self.spacing
        half = half_size(width / 2, spacing)
        left = width / 2 + spacing * (np.arange(-half, half + 1) - 0.5)
        fraction = overlap_lengths(left, spacing, samples, self.spacing) / self.spacing
        return normalised(
            np.einsum("ij,jk,lk->il", fraction, self.weights, fraction, optimize=True)
        )


@dataclass(frozen=True)
class ApertureChoice(PSFChoice):
    """Diffraction by the data sheet of a lens; one of the two is given."""

    numerical_aperture: Annotated[
        float | None, Parameter("Numerical aperture on the scene's side.", over=0.0, most=1.0)
    ] = None
    f_number: Annotated[
        float | None,
        Parameter(
            "F-number of the lens, focused at infinity; with the camera's magnification m the "
            "numerical aperture is m / (2 f_number (1 + m)).",
            over=0.0,
        ),
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.numerical_aperture is None) == (self.f_number is None):
            raise ValueError("expected one of numerical_aperture and f_number")

    def aperture(self, magnification: float | None) -> float:
        """Return the numerical aperture on the scene's side; an f-number needs a magnification."""
        if self.numerical_aperture is not None:
            return self.numerical_aperture
        assert self.f_number is not None
        if magnification is None:
            raise ValueError("magnification: is missing, expected it with psf.f_number")
        return magnification / (2 * self.f_number * (1 + magnification))


@PSFS.part
@dataclass(frozen=True)
class AiryAperture(ApertureChoice):
    """Diffraction of a round aperture, by the data sheet of a lens."""

    kind = "airy"
    example = "{kind: airy, f_number: 2.5}  or numerical_aperture: a round aperture"
    wavelength: DiffractionWavelength = None

    def for_camera(self, band: Band, magnification: float | None) -> PointSpreadFunction:
        wavelength = self.wavelength or (band.lower + band.upper) / 2
        return AnnularAperturePSF(wavelength, self.aperture(magnification), 0.0)


@PSFS.part
@dataclass(frozen=True)
class MeasuredPSFFile(PSFChoice):
    """A kernel from a file."""

    kind = "measured"
    example = "{kind: measured, file: psf.nc}  of chipglow psf; .npy or .csv with spacing: 1 um"
    file: Annotated[FileBeside, Parameter("File of the kernel, .npy, .csv or .nc.")]
    spacing: Annotated[
        float | None,
        Parameter(
            "Side of the kernel's samples; none for a .nc, which states it.",
            LENGTH,
            over=0.0,
            most=0.1,
        ),
    ] = None

    includes: Annotated[
        tuple[str, ...] | None,
        Parameter(
            "What it holds besides the optics, because it was measured through it: footprint for "
            "the pixel's sensitive square, and kinds of blur; none: what a .nc says, or nothing."
        ),
    ] = None

    psf: MeasuredPSF = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        psf = MeasuredPSF.from_file(self.file, self.spacing, self.includes)
        object.__setattr__(self, "psf", psf)

    def for_camera(self, band: Band, magnification: float | None) -> PointSpreadFunction:
        return self.psf


def _jinc(v: Array) -> Array:
    """Return 2 J1(v) / v."""
    safe = np.where(v == 0.0, 1.0, v)
    return np.where(v == 0.0, 1.0, 2 * j1(safe) / safe)


def _with_the_rest(kernel: Array, spacing: float) -> Array:
    """Return a kernel with one more ring of squares that holds all that it lacks of 1.

    Far away the mean of diffraction's rings falls as 1/r³. The integral of that over all x > X and
    y > Y is (X + Y − R) / XY, and over all x > X and y of 0 to Y it is (R − X) / XY, with
    R² = X² + Y².
    """
    y, x = (spacing * (np.arange(n + 1) - n / 2) for n in kernel.shape)
    corner = np.hypot(x[-1], y[-1])
    ring = np.zeros((kernel.shape[0] + 2, kernel.shape[1] + 2))
    ring[1:-1, [0, -1]] = np.diff((np.hypot(x[-1], y) - x[-1]) / (x[-1] * y))[:, None]
    ring[[0, -1], 1:-1] = np.diff((np.hypot(y[-1], x) - y[-1]) / (y[-1] * x))
    ring[np.ix_([0, -1], [0, -1])] = (x[-1] + y[-1] - corner) / (x[-1] * y[-1])
    return np.asarray(np.pad(kernel, 1) + ring * (1 - kernel.sum()) / ring.sum())


def _checked_weights(weights: ArrayLike) -> Array:
    array = np.asarray(weights, dtype=np.float64)
    if array.ndim != 2 or array.shape[0] != array.shape[1] or array.shape[0] % 2 == 0:
        raise ValueError(f"psf: kernel has shape {array.shape}, expected a square of odd side")
    if not (array >= 0.0).all() or not 0.0 < array.sum() < inf:
        raise ValueError("psf: kernel must be finite, 0 or more, and not 0 everywhere")
    return array


def _read_array(path: Path) -> Array:
    if path.suffix.lower() == ".npy":
        with path.open("rb") as file:
            return np.asarray(np.lib.format.read_array(file, allow_pickle=False))
    rows = path.read_text(encoding="utf-8-sig").splitlines()
    return np.array([[float(cell) for cell in row.split(",")] for row in rows if row.strip()])


def _read_netcdf(path: Path) -> tuple[Estimate, float, tuple[str, ...]]:
    """Return kernel, with the components of its uncertainty if any, spacing and `includes`."""
    if not path.is_file():
        raise FileNotFoundError(ENOENT, "there is no such file", str(path))
    try:
        check_own_data(path)
        with xr.open_dataset(path, engine="h5netcdf", phony_dims="access") as data:
            kernel = data["kernel"].attrs
            stated = tuple(str(kernel.get("includes", "")).split())
            return from_xarray(data, "kernel"), float(kernel["spacing"]), stated
    except OSError as error:
        raise ValueError(f"cut short, or no NetCDF-4 file: {error}") from error
