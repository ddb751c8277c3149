"""Point spread functions of an infrared camera."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from errno import ENOENT
from functools import cached_property
from math import ceil, inf, log, pi, sqrt
from pathlib import Path
from typing import Annotated, Any, Final

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
from chipglow.text import HDF5_ERRORS, check_bounds, check_own_data, read_matrix
from chipglow.uncertainty import Component, Estimate, from_xarray

GAUSSIAN_ENERGY: Final = 1.0 - 1e-12
"""Fraction of a Gaussian's light within its kernel: all but rounding.

A smaller fraction such as 0.9999 is not enough: in a band of 1.0 to 1.7 um, a surface at 1300 K
radiates 10 000 times as much as one at 573 K next to it.
"""

ANNULAR_ENERGY: Final = 0.99
"""Fraction of diffracted light within `AnnularAperturePSF.kernel`; that beyond r falls as 1/r."""

FWHM_PER_SIGMA: Final = 2 * sqrt(2 * log(2))
"""Ratio of full width at half maximum to standard deviation of a Gaussian."""

_FAR: Final = 30.0
"""Radius v beyond which the mean irradiance of diffraction rings falls as 1/r³, within 2 %."""

_SAME_LIMIT: Final = 0.01
"""Accepted relative difference of the limits of two bands: people state two or three digits."""

PSFS: Final = Family("psf")
"""Point spread functions by kind; other packages register theirs in the group ``chipglow.psf``."""


DiffractionWavelength = Annotated[
    float | None,
    Parameter(
        "Wavelength of the diffraction; none: the centre of the camera's band.",
        WAVELENGTH,
        most=0.1,
    ),
]

Obscuration = Annotated[
    float, Parameter("Central obstruction as a fraction of the diameter.", least=0.0, most=0.9)
]


class PSFChoice(Part, ABC):
    """Settings from which a camera's point spread function is made."""

    @abstractmethod
    def for_camera(self, band: Band, magnification: float | None) -> "PointSpreadFunction":
        """Return that on the scene for a band and, if required, a magnification of the lens."""


class PointSpreadFunction(PSFChoice):
    """Distribution of a point's light over the scene's plane.

    `fwhm` is its full width at half maximum in m. `includes` names effects that it contains in
    addition to the optics: ``footprint`` for the sensitive area of a pixel, or kinds of
    `chipglow.camera.BLURS`. A camera does not apply them again.
    """

    fwhm: float
    includes: tuple[str, ...] = ()

    def for_camera(self, band: Band, magnification: float | None) -> "PointSpreadFunction":
        return self

    def in_band(self, band: Band) -> "PointSpreadFunction":
        """Return the point spread function in another band; itself if it is not diffraction."""
        return self

    @abstractmethod
    def kernel(self, spacing: float) -> Array:
        """Return the fractions of a point's light on squares with sides of `spacing` in m.

        A square array with an odd number of rows, first row on top; the point is at its centre. Its
        sum is less than 1 by the light outside: `GAUSSIAN_ENERGY`, `ANNULAR_ENERGY`.
        """

    def view_kernel(self, spacing: float, rows: int, columns: int) -> Array:
        """Return the fractions of all of a point's light, of sum 1, on a grid of limited size.

        At most `rows` and `columns` of squares with sides of `spacing` in m are on each side of the
        central one, which has the point at its centre; the border squares also contain the light
        beyond them.
        """
        return folded(normalised(self.kernel(spacing)), rows, columns)


@PSFS.part
@dataclass(frozen=True)
class AnnularAperturePSF(PointSpreadFunction):
    """Diffraction of a reflecting microscope objective.

    The pupil is round with a central round obstruction o. The irradiance is
    [2 J1(v)/v − o² 2 J1(ov)/(ov)]² / (1 − o²)² with v = 2π NA r / λ (Born and Wolf, Principles of
    Optics, 8.6.2). Aberrations and the detector are not included.

    The paper shows the point spread function of its camera as a figure only (Figure 2). The default
    values are assumed; they are typical of a 15x reflecting (Schwarzschild) objective.
    """

    kind = "annular-aperture"
    example = "{kind: annular-aperture, numerical_aperture: 0.28}"
    wavelength: DiffractionWavelength = 4.5e-6
    numerical_aperture: Annotated[
        float, Parameter("Numerical aperture of the objective.", over=0.0, most=1.0)
    ] = 0.28
    obscuration: Obscuration = 0.35

    def __str__(self) -> str:
        of = f", obscured to {self.obscuration:g} of its diameter" if self.obscuration else ""
        at = "" if self.wavelength is None else f", at {self.wavelength * 1e6:g} µm"
        return f"diffraction of a round pupil of NA {self.numerical_aperture:.3g}{of}{at}"

    @cached_property
    def fwhm(self) -> float:  # type: ignore[override]
        # The profile falls below a half between these v, with any obscuration.
        half = scipy.optimize.brentq(lambda v: float(self._profile(np.array(v))) - 0.5, 0.1, 3.0)
        return 2 * float(half) * self._unit

    def for_camera(self, band: Band, magnification: float | None) -> "AnnularAperturePSF":
        return self if self.wavelength is not None else self.in_band(band)

    def in_band(self, band: Band) -> "AnnularAperturePSF":
        """Return the diffraction at the band's central wavelength."""
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
        # Gauss nodes: two, and three more for each ring (π in v) across a square.
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
            raise ValueError("psf: wavelength is none; set it, or use the psf in a camera")
        return self.wavelength / (2 * pi * self.numerical_aperture)

    @property
    def _reach(self) -> float:
        """Radius v that encircles `ANNULAR_ENERGY`."""
        # Beyond the first rings, the fraction outside is 2 / (π v (1 − o)).
        far = 4 / (pi * (1 - self.obscuration) * (1 - ANNULAR_ENERGY))
        v = np.linspace(0.0, far, ceil(20 * far))  # about 60 points per ring of width π
        clear = 1 - self.obscuration**2
        inside = scipy.integrate.cumulative_simpson(
            clear / 2 * self._profile(v) * v, x=v, initial=0.0
        )
        return float(v[np.searchsorted(inside, ANNULAR_ENERGY)])

    def _profile(self, v: Array) -> Array:
        return self._amplitude(v) ** 2

    def _amplitude(self, v: Array) -> Array:
        inner = self.obscuration**2
        return np.asarray((jinc(v) - inner * jinc(self.obscuration * v)) / (1 - inner))


@PSFS.part
@dataclass(frozen=True)
class GaussianPSF(PointSpreadFunction):
    """A round Gaussian."""

    kind = "gaussian"
    example = "{kind: gaussian, fwhm: 12 um}"
    fwhm: Annotated[float, Parameter("Full width at half maximum.", LENGTH, most=0.1)]

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
    """A measured kernel, such as from a knife edge.

    Parameters
    ----------
    weights : array_like
        Light of a point on each square of a grid, in any unit: a square array with an odd number
        of rows, first row on top. The point is at the centre of the central square.
    spacing : float
        Side of a square in m, on the scene.
    components : tuple of Component
        Uncertainty of the weights as effects of independent errors, in the unit of the weights;
        ``chipglow psf`` writes them to its files. Unknown by default.
    includes : tuple of str
        Effects that the measurement contains in addition to the optics: ``footprint`` for the
        sensitive area of a pixel, and kinds of `chipglow.camera.BLURS`.
    band : Band, optional
        Spectral band of the measurement. A camera with another one refuses the kernel, as
        diffraction and focus depend on the wavelength. Unknown by default.

    Notes
    -----
    `fwhm` is the mean of the widths along the row and the column through the peak; of several equal
    values, the most central is the peak. For another spacing, the light within each measured square
    is taken as uniform and distributed by area. The weights are scaled to a sum of 1, so that light
    outside the measured kernel is neglected.
    """

    weights: Array = field(repr=False)
    spacing: float
    components: tuple[Component, ...] = field(default=(), repr=False)
    includes: tuple[str, ...] = ()
    band: Band | None = None
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

    def for_camera(self, band: Band, magnification: float | None) -> "MeasuredPSF":
        if self.band is not None and not _is_same(self.band, band):
            raise ValueError(
                f"psf: was measured in the band {_limits(self.band)}, expected that of the camera, "
                f"{_limits(band)}"
            )
        return self

    def in_band(self, band: Band) -> "MeasuredPSF":
        return replace(self, band=None)

    @classmethod
    def from_file(
        cls, path: str | Path, spacing: float | None = None, includes: tuple[str, ...] | None = None
    ) -> "MeasuredPSF":
        """Read a kernel from a NumPy array (``.npy``), a table (``.csv``) or a NetCDF file.

        A ``.nc`` file comes from ``chipglow psf`` and states its spacing; for other files `spacing`
        in m on the scene is required. `includes` overrides the effects that a ``.nc`` file states.
        Raises a ValueError that names the file if it does not contain a kernel.
        """
        path = Path(path)
        kind = path.suffix.lower()
        if kind not in (".npy", ".csv", ".nc"):
            raise ValueError(f"psf: {path} must be a .npy, .csv or .nc file")
        if (spacing is None) != (kind == ".nc"):
            raise ValueError(
                f"psf: {path} states its spacing; omit spacing"
                if kind == ".nc"
                else f"psf: {path} requires a spacing such as 1e-6 m"
            )
        try:
            if spacing is None:
                psf = _read_netcdf(path)
                return psf if includes is None else replace(psf, includes=includes)
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
    """Aperture from the data sheets of lens and camera: the smaller of their cones of light."""

    numerical_aperture: Annotated[
        float | None, Parameter("Numerical aperture on the scene's side.", over=0.0, most=1.0)
    ] = None
    f_number: Annotated[
        float | None,
        Parameter(
            "F-number of the lens, focused at infinity; at the camera's magnification m, the "
            "numerical aperture is m / (2 f_number (1 + m)).",
            over=0.0,
        ),
    ] = None
    working_f_number: Annotated[
        float | None,
        Parameter(
            "F-number of the light at the detector, of a cooled camera that of its cold stop; the "
            "numerical aperture is m / (2 working_f_number), or that of the lens if it is smaller.",
            over=0.0,
        ),
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        given = {
            name
            for name in ("numerical_aperture", "f_number", "working_f_number")
            if getattr(self, name) is not None
        }
        if len(given) != 1 and given != {"numerical_aperture", "working_f_number"}:
            raise ValueError(
                "set numerical_aperture, f_number or working_f_number; only numerical_aperture "
                "and working_f_number can be combined"
            )

    def aperture(self, magnification: float | None) -> float:
        """Return the numerical aperture on the scene's side."""
        if self.working_f_number is None and self.numerical_aperture is not None:
            return self.numerical_aperture
        name = "f_number" if self.working_f_number is None else "working_f_number"
        if magnification is None:
            raise ValueError(f"magnification: is missing but required for psf.{name}")
        if self.f_number is not None:
            return magnification / (2 * self.f_number * (1 + magnification))
        assert self.working_f_number is not None
        aperture = magnification / (2 * self.working_f_number)
        if self.numerical_aperture is not None:
            return min(aperture, self.numerical_aperture)
        if aperture > 1:
            raise ValueError(
                f"working_f_number: {self.working_f_number:g} gives a numerical aperture of "
                f"{aperture:.3g} at the magnification {magnification:g}, which must be at most 1"
            )
        return aperture


@PSFS.part
@dataclass(frozen=True)
class AiryAperture(ApertureChoice):
    """Diffraction of a round aperture."""

    kind = "airy"
    example = "{kind: airy, f_number: 2.5}  or numerical_aperture: a round aperture"
    wavelength: DiffractionWavelength = None

    def for_camera(self, band: Band, magnification: float | None) -> PointSpreadFunction:
        wavelength = self.wavelength or (band.lower + band.upper) / 2
        return AnnularAperturePSF(wavelength, self.aperture(magnification), 0.0)


@PSFS.part
@dataclass(frozen=True)
class MeasuredPSFFile(PSFChoice):
    """A kernel from a file.

    It states values that the file does not: None for those of a .nc file. `MeasuredPSF` has the
    values.
    """

    kind = "measured"
    example = "{kind: measured, file: psf.nc}  of chipglow psf; .npy or .csv with spacing: 1 um"
    file: Annotated[FileBeside, Parameter("File of the kernel, .npy, .csv or .nc.")]
    spacing: Annotated[
        float | None,
        Parameter(
            "Distance between the samples of the kernel; a .nc file states it.", LENGTH, most=0.1
        ),
    ] = None

    includes: Annotated[
        tuple[str, ...] | None,
        Parameter(
            "Effects that the measured kernel contains in addition to the optics: footprint for "
            "the sensitive area of a pixel, and kinds of blur; none: as stated by a .nc file."
        ),
    ] = None

    psf: MeasuredPSF = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        psf = MeasuredPSF.from_file(self.file, self.spacing, self.includes)
        object.__setattr__(self, "psf", psf)

    def for_camera(self, band: Band, magnification: float | None) -> PointSpreadFunction:
        try:
            return self.psf.for_camera(band, magnification)
        except ValueError as error:
            raise ValueError(f"{self.file}: {error}") from None


def _is_same(band: Band, other: Band) -> bool:
    limits = (band.lower, other.lower), (band.upper, other.upper)
    return all(abs(one - two) <= _SAME_LIMIT * two for one, two in limits)


def _limits(band: Band) -> str:
    return f"{WAVELENGTH.text(band.lower)} to {WAVELENGTH.text(band.upper)}"


def jinc(v: Array) -> Array:
    """Return 2 J1(v) / v."""
    safe = np.where(v == 0.0, 1.0, v)
    return np.where(v == 0.0, 1.0, 2 * j1(safe) / safe)


def _with_the_rest(kernel: Array, spacing: float) -> Array:
    """Surround a kernel with a ring of squares that contain the rest of the light.

    Far away, the mean of the diffraction rings falls as 1/r³. Its integral over x > X and y > Y is
    (X + Y − R) / XY, and over x > X and 0 < y < Y it is (R − X) / XY, with R² = X² + Y².
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
        raise ValueError(
            f"psf: kernel must be square with an odd number of rows, but has shape {array.shape}"
        )
    if not (array >= 0.0).all() or not 0.0 < array.sum() < inf:
        raise ValueError("psf: kernel must be finite, not negative, and not 0 everywhere")
    return array


def _read_array(path: Path) -> Array:
    if path.suffix.lower() == ".npy":
        with path.open("rb") as file:
            return np.asarray(np.lib.format.read_array(file, allow_pickle=False))
    frames = read_matrix(path).values
    if len(frames) > 1:
        raise ValueError(f"{path}: has {len(frames)} matrices, must have 1")
    return np.asarray(frames[0])


def _read_netcdf(path: Path) -> MeasuredPSF:
    """Read a kernel with its uncertainty components, and what is stated of it."""
    if not path.is_file():
        raise FileNotFoundError(ENOENT, "there is no such file", str(path))
    try:
        check_own_data(path)
        check_bounds(path)
        with xr.open_dataset(path, engine="h5netcdf", phony_dims="access") as data:
            kernel = data["kernel"].attrs
            stated = tuple(str(kernel.get("includes", "")).split())
            band = _stated_band(kernel)
            estimate, spacing = from_xarray(data, "kernel"), float(kernel["spacing"])
    except ValueError:
        raise
    except HDF5_ERRORS as error:
        raise ValueError(f"truncated, or not a NetCDF-4 file: {error}") from error
    return MeasuredPSF(estimate.values, spacing, estimate.components, stated, band)


def _stated_band(attributes: Mapping[str, Any]) -> Band | None:
    """Return the band of a kernel, from its attributes in a file; None if none is stated."""
    if "band_lower" not in attributes or "band_upper" not in attributes:
        return None
    return Band(float(attributes["band_lower"]), float(attributes["band_upper"]))
