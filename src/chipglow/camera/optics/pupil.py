"""Point spread function of a pupil with obscuration, defocus and aberrations, over a band."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, factorial, log2, pi, sqrt
from numbers import Integral, Real
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import PlainSerializer, PlainValidator, WithJsonSchema
from scipy import fft
from scipy.ndimage import map_coordinates

from chipglow.camera.detector.response import in_tables
from chipglow.camera.optics.kernel import (
    check_length,
    folded,
    half_size,
    kernel_fwhm,
    normalised,
    poisson_squares,
    resized,
)
from chipglow.camera.optics.psf import PSFS, ApertureChoice, Obscuration, PointSpreadFunction
from chipglow.quantities import Array, Parameter, Part
from chipglow.quantities.units import POSITION
from chipglow.radiometry import Band

PUPIL_ENERGY: Final = 0.99
"""Fraction of a pupil's light within `PupilPSF.kernel`; `PupilPSF.view_kernel` contains all."""

_WAVELENGTHS: Final = 12
"""Wavelengths over which the light of a band is summed."""

_FEWEST_SAMPLES: Final = 256
"""Fewest samples along the diameter of a pupil."""

_COARSEST_STEP: Final = 0.25
"""Largest phase step in rad between neighbouring samples of a pupil."""

_MOST_SAMPLES: Final = 1024
"""Most samples along the diameter; larger aberrations are refused."""

_CORE_RADIUS: Final = 100.0
"""Radius of the core, beyond which the mean of the rings is a tail, in units of wavelength / (2π
numerical aperture)."""

_LARGEST_RADIUS: Final = 300.0
"""Largest radius to which a view extends the core, in the same unit."""

_TAIL_FACTOR: Final = 6.0
"""Length of the tail's transfer function in lengths of the tail."""

_FREQUENCY_REACH: Final = 2.0
"""Frequencies of a core in cut-off frequencies of the pupil."""

_PERIODS: Final = 3.0
"""Period of the discrete transform in sides of the core, so that its repetitions are far away."""

_MAX_NOLL_INDEX: Final = 120
"""Largest Noll index: all Zernike polynomials of the first 15 radial orders."""

_MAX_RMS: Final = 1e-3
"""Largest root mean square of an aberration in m."""

_POINT: Final = 1e-12
"""Radius of a disc that counts as a point."""

_WIDTH_SQUARES: Final = 128
"""Squares along half of the image from which a width is read."""


def _zernike(value: Any) -> Any:
    """Validate pairs of Noll index and rms in m, or a mapping from index to length."""
    if isinstance(value, Mapping):
        pairs = tuple((_whole(index), POSITION.parse(rms)) for index, rms in value.items())
    elif isinstance(value, tuple):
        pairs = value
    else:
        raise ValueError(f"{value!r} is not a mapping of Noll indices such as {{11: 0.2 um}}")
    used: set[int] = set()
    for pair in pairs:
        index, rms = pair if isinstance(pair, tuple) and len(pair) == 2 else (None, None)
        if (
            not (isinstance(index, Integral) and 4 <= int(index) <= _MAX_NOLL_INDEX)
            or index in used
            or not (isinstance(rms, Real) and abs(float(rms)) <= _MAX_RMS)
        ):
            raise ValueError(
                f"{pair!r}, expected Noll's index, 4 to {_MAX_NOLL_INDEX}, each once, and its rms "
                "in m"
            )
        used.add(index)
    return pairs


def _whole(index: object) -> Any:
    """Convert an index written as text, such as a JSON key."""
    return int(index) if isinstance(index, str) and re.fullmatch("[0-9]{1,3}", index) else index


Defocus = Annotated[
    float,
    Parameter(
        "Distance of the surface behind the plane of best focus, seen from the lens.",
        POSITION,
        least=-0.01,
        most=0.01,
    ),
]
Aberrations = Annotated[
    tuple[tuple[int, float], ...],
    PlainValidator(_zernike),
    PlainSerializer(
        lambda pairs: {index: POSITION.text(rms) for index, rms in pairs}, when_used="json"
    ),
    WithJsonSchema(
        {
            "type": "object",
            "patternProperties": {"^[0-9]+$": {"type": "string", "examples": ["0.2 um"]}},
        }
    ),
    Parameter(
        f"Zernike aberrations by Noll's index, 4 to {_MAX_NOLL_INDEX}: root mean square of the\n"
        "optical path difference over the unobscured pupil."
    ),
]
SourceTemperature = Annotated[
    float, in_tables("Temperature of the blackbody whose spectrum weights the wavelengths.")
]


@dataclass(frozen=True)
class _Aperture(PointSpreadFunction):
    """Band and aperture, which come first of a `PupilPSF`."""

    band: Band
    numerical_aperture: Annotated[
        float, Parameter("Numerical aperture on the scene's side.", over=0.0, most=1.0)
    ]


@dataclass(frozen=True)
class Wavefront(Part):
    """Obscuration and aberrations of an aperture, and the spectrum of its light."""

    obscuration: Obscuration = 0.0
    defocus: Defocus = 0.0
    zernike: Aberrations = ()
    temperature: SourceTemperature = 1000.0


@dataclass(frozen=True)
class PupilPSF(Wavefront, _Aperture):
    """Diffraction of a pupil with obscuration, defocus and aberrations, over a camera's band.

    Wavelengths are weighted by the spectral radiance of a blackbody and by the band's response
    relative to energy (for a photon detector: proportional to wavelength times quantum efficiency).
    `fwhm` is the mean of the widths along the row and the column through the peak.

    Parameters
    ----------
    band : Band
        Band of the camera, with its response.

    Raises
    ------
    ValueError
        If a value is out of its limits, or the aberrations exceed about 10 wavelengths.

    Notes
    -----
    With the pupil coordinate ρ (the sine of the angle over the aperture, for an aplanatic lens),
    the path difference W and P = 1 within the pupil, light of the wavelength λ from a point has the
    density ``|∫ P exp(2πi (W − NA ρ·x) / λ) d²ρ|²`` on the scene's plane (Born and Wolf, Principles
    of Optics, 9.1; scalar paraxial theory). A ray arrives at ∇W / NA. Defocus by z is
    W = z (√(1 − NA² ρ²) − 1) (Hanser et al., J. Microsc. 216 (2004) 32). The Zernike polynomials
    are by Noll, J. Opt. Soc. Am. 66 (1976) 207.

    The transfer function of the pupil without aberrations is in closed form (O'Neill, J. Opt. Soc.
    Am. 46 (1956) 285); its change due to aberrations is computed on a grid. Far away, the light
    falls as a / (2π r³) with a = λ / (π² NA (1 − o)) for any aberrations. This tail is subtracted
    in closed form before the sum over frequencies and added after it, so that no light is lost.
    """

    def __str__(self) -> str:
        of = f", obscured to {self.obscuration:g} of its diameter" if self.obscuration else ""
        out = f", {self.defocus * 1e6:g} µm out of focus" if self.defocus else ""
        bent = ", with aberrations" if self.zernike else ""
        return (
            f"a round pupil of NA {self.numerical_aperture:.3g}{of}{out}{bent}, over "
            f"{self.band.lower * 1e6:g} µm to {self.band.upper * 1e6:g} µm"
        )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._samples > _MOST_SAMPLES:
            raise ValueError(
                f"psf: defocus and aberrations have a slope of {self._slope:.3g} m per pupil "
                "radius; the limit is some 10 wavelengths"
            )

    @cached_property
    def fwhm(self) -> float:  # type: ignore[override]
        half = _WIDTH_SQUARES
        spacing = (self._geometric + self._shortest / self.numerical_aperture) / half
        kernel = self._squares(spacing, half, half, beyond=False)
        return kernel_fwhm(kernel, spacing)

    def transfer(self, across: Array, up: Array) -> NDArray[np.complex128]:
        """Return the complex optical transfer function: 1 at zero frequency, 0 above 2 NA / λ.

        Frequencies `across` and `up` are in 1/m and are broadcast against each other.
        """
        across, up = np.broadcast_arrays(across, up)
        frequency = np.hypot(across, up)
        result = np.zeros(frequency.shape, np.complex128)
        for wavelength, weight, change in zip(*self._spectrum, self._changes, strict=True):
            scale = wavelength / self.numerical_aperture
            passed = scale * frequency < 2.0
            part = annular_transfer(scale * frequency[passed] / 2, self.obscuration) + 0j
            if change is not None:
                step = 2.0 / self._samples
                places = np.stack([up[passed], across[passed]]) * scale / step + self._samples
                part += map_coordinates(change, places, order=3, mode="grid-constant")
            result[passed] += weight * part
        return result

    def in_band(self, band: Band) -> "PupilPSF":
        return replace(self, band=band)

    def kernel(self, spacing: float) -> Array:
        half = half_size(self._tail / (1 - PUPIL_ENERGY) + self._geometric, spacing)
        return self._squares(spacing, half, half, beyond=False)

    def view_kernel(self, spacing: float, rows: int, columns: int) -> Array:
        check_length("spacing", spacing)
        return normalised(self._squares(spacing, rows, columns, beyond=True))

    def _squares(self, spacing: float, rows: int, columns: int, beyond: bool) -> Array:
        """Return fractions of the light on squares; with `beyond`, border squares have the rest."""
        unit = self._shortest / (2 * pi * self.numerical_aperture)
        near = _CORE_RADIUS * unit + 2 * self._geometric
        reach = max(near, min((max(rows, columns) + 0.5) * spacing, _LARGEST_RADIUS * unit))
        half = half_size(reach, spacing)
        core = self._core(spacing, half)
        if beyond:
            core = folded(core, rows, columns)
        core = resized(core, rows, columns)
        tail = poisson_squares(spacing, rows, columns, self._tail, self._width, beyond)
        return np.maximum(core + tail, 0.0)

    def _core(self, spacing: float, half: int) -> Array:
        """Return fractions of the light on squares, minus the tail."""
        step = 1 / (_PERIODS * (2 * half + 1) * spacing)
        count = ceil(_FREQUENCY_REACH * 2 * self.numerical_aperture / self._shortest / step)
        up = step * np.arange(-count, count + 1, dtype=np.float64)
        across = step * np.arange(count + 1, dtype=np.float64)
        frequency = np.hypot(across, up[:, None])
        spread = 2 * pi * self._width
        tail = np.exp(-spread * frequency) * (1 + (spread - 2 * pi * self._tail) * frequency)
        image = self.transfer(across, up[:, None]) - tail
        # The image is real: frequencies to the left equal those to the right.
        image[:, 1:] *= 2.0
        position = spacing * np.arange(-half, half + 1)
        rows, columns = (
            np.exp(2j * pi * np.outer(position, f)) * np.sinc(spacing * f) for f in (up, across)
        )
        # The first row is on top.
        return np.asarray(((rows[::-1] @ image) @ columns.T).real * (spacing * step) ** 2)

    @cached_property
    def _spectrum(self) -> tuple[Array, Array]:
        return self.band.spectrum(self.temperature, _WAVELENGTHS)

    @property
    def _shortest(self) -> float:
        return float(self._spectrum[0][0])

    @cached_property
    def _tail(self) -> float:
        """Length a in m of the tail a / (2π r³)."""
        mean = float(self._spectrum[0] @ self._spectrum[1])
        return mean / (pi**2 * self.numerical_aperture * (1 - self.obscuration))

    @property
    def _width(self) -> float:
        """Length b in m of the tail's transfer function; see `poisson_squares`."""
        return _TAIL_FACTOR * self._tail * (1 - self.obscuration)

    @cached_property
    def _slope(self) -> float:
        """Largest slope of the path difference in m per radius of the pupil."""
        x = np.linspace(-1.0, 1.0, _FEWEST_SAMPLES + 1)
        difference = self._path(x, x[:, None])
        steep = np.hypot(*np.gradient(difference, x[1] - x[0]))
        return float(steep[np.hypot(x, x[:, None]) <= 1.0].max())

    @property
    def _geometric(self) -> float:
        """Largest displacement of rays in the image in m."""
        return self._slope / self.numerical_aperture

    @cached_property
    def _samples(self) -> int:
        """Samples across a pupil, a power of two."""
        phase = 2 * pi * self._slope / self._shortest
        return max(_FEWEST_SAMPLES, 1 << ceil(log2(max(2 * phase / _COARSEST_STEP, 1.0))))

    @property
    def _changes(self) -> Iterator[NDArray[np.complex128] | None]:
        """Change of the transfer function due to the path difference, for each wavelength.

        The grid has the spacing of the pupil samples; zero frequency is at [samples, samples].
        """
        if not self._slope:
            yield from [None] * _WAVELENGTHS
            return
        count = self._samples
        x = (np.arange(count) - (count - 1) / 2) * 2 / count
        radius = np.hypot(x, x[:, None])
        # A sample on the edge is weighted by the fraction inside.
        pupil = np.clip((1 - radius) * count / 2 + 0.5, 0.0, 1.0)
        pupil -= np.clip((self.obscuration - radius) * count / 2 + 0.5, 0.0, 1.0)
        path = self._path(x, x[:, None])
        plain = _autocorrelation(pupil.astype(np.complex128))
        for wavelength in self._spectrum[0]:
            aberrated = _autocorrelation(
                np.asarray(pupil * np.exp(2j * pi / wavelength * path), np.complex128)
            )
            # Divided by the sum: in the central value, a sample on the edge has its squared weight.
            yield (aberrated - plain) / pupil.sum()

    def _path(self, x: Array, y: Array) -> Array:
        """Return the optical path difference in m at pupil coordinates."""
        radius = np.hypot(x, y)
        inside = np.maximum(1 - (self.numerical_aperture * radius) ** 2, 0.0)
        path = self.defocus * (np.sqrt(inside) - 1)
        for index, rms in self.zernike:
            path = path + rms * zernike_polynomial(index, radius, np.arctan2(y, x))
        return np.asarray(path)


@PSFS.part
@dataclass(frozen=True)
class Pupil(Wavefront, ApertureChoice):
    """A pupil with obscuration, defocus and aberrations, over the camera's band."""

    kind = "pupil"
    example = (
        "{kind: pupil, numerical_aperture: 0.28, obscuration: 0.35, defocus: 10 um,\n"
        "    zernike: {11: 0.2 um}}"
    )

    def for_camera(self, band: Band, magnification: float | None) -> PointSpreadFunction:
        lens = self.obscuration, self.defocus, self.zernike, self.temperature
        return PupilPSF(band, self.aperture(magnification), *lens)


def annular_transfer(frequency: Array, obscuration: float) -> Array:
    """Return the transfer function of an annular pupil without aberrations.

    `frequency` is relative to 2 NA / λ (O'Neill, J. Opt. Soc. Am. 46 (1956) 285).
    """
    apart = 2 * frequency
    shared = (
        _shared_area(apart, 1.0, 1.0)
        - 2 * _shared_area(apart, 1.0, obscuration)
        + _shared_area(apart, obscuration, obscuration)
    )
    return np.asarray(shared / (pi * (1 - obscuration**2)))


def zernike_polynomial(index: int, radius: Array, angle: Array) -> Array:
    """Return Noll's Zernike polynomial, normalised to a mean square of 1 over the unit disc.

    `angle` is in rad from the right (Noll, J. Opt. Soc. Am. 66 (1976) 207, Equations 1 to 3).
    """
    n, m = _noll(index)
    value = np.zeros(np.broadcast(radius, angle).shape)
    for k in range((n - m) // 2 + 1):
        divisor = factorial(k) * factorial((n + m) // 2 - k) * factorial((n - m) // 2 - k)
        value = value + (-1) ** k * factorial(n - k) / divisor * radius ** (n - 2 * k)
    if m == 0:
        return sqrt(n + 1) * value
    turn = np.cos(m * angle) if index % 2 == 0 else np.sin(m * angle)
    return np.asarray(sqrt(2 * (n + 1)) * value * turn)


def _noll(index: int) -> tuple[int, int]:
    """Convert a Noll index to degree and order."""
    n = 0
    while (n + 1) * (n + 2) // 2 < index:
        n += 1
    rank = index - n * (n + 1) // 2
    return n, 2 * (rank // 2) if n % 2 == 0 else 2 * ((rank - 1) // 2) + 1


def _shared_area(apart: Array, first: float, second: float) -> Array:
    """Return the common area of two discs with the given radii and distance of centres."""
    if second < _POINT:
        return np.zeros(apart.shape)
    d = np.clip(apart, max(abs(first - second), _POINT), first + second)
    one = np.arccos(np.clip((d**2 + first**2 - second**2) / (2 * d * first), -1, 1))
    two = np.arccos(np.clip((d**2 + second**2 - first**2) / (2 * d * second), -1, 1))
    kite = ((first + second) ** 2 - d**2) * (d**2 - (first - second) ** 2)
    area = first**2 * one + second**2 * two - np.sqrt(np.maximum(kite, 0.0)) / 2
    area = np.where(apart <= abs(first - second), pi * min(first, second) ** 2, area)
    # Without this, rounding leaves a rest where the discs do not overlap.
    return np.where(apart >= first + second, 0.0, area)


def _autocorrelation(pupil: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return ∫ P(ρ) P*(ρ + s) on steps of the samples, shape (2 n, 2 n), s = 0 at [n, n]."""
    twice = [2 * count for count in pupil.shape]
    power = np.abs(fft.fft2(pupil, twice)) ** 2
    return np.asarray(fft.fftshift(np.conj(fft.ifft2(power))))
