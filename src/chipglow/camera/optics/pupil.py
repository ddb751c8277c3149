"""Point spread function of a pupil: obscuration, defocus and aberrations, over a band."""

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

from chipglow.camera.optics.kernel import (
    check_length,
    folded,
    half_size,
    kernel_fwhm,
    normalised,
    poisson_squares,
    resized,
)
from chipglow.camera.optics.psf import PSFS, ApertureChoice, PointSpreadFunction
from chipglow.quantities import Array, Parameter
from chipglow.quantities.units import POSITION, TEMPERATURE
from chipglow.radiometry import Band

PUPIL_ENERGY: Final = 0.99
"""Fraction of a pupil's light that `PupilPSF.kernel` holds; `PupilPSF.view_kernel` holds all."""

_WAVELENGTHS: Final = 12
_FINEST_PUPIL: Final = 256
_COARSEST_STEP: Final = 0.25
"""Change of the phase in rad between neighbouring samples of a pupil, at most."""

_LARGEST_PUPIL: Final = 1024
_NEAR: Final = 100.0
_FAR: Final = 300.0
_TAIL: Final = 6.0
_FINEST: Final = 2.0
_PERIOD: Final = 3.0
_MOST_ZERNIKE: Final = 120
_STRONGEST: Final = 1e-3
_POINT: Final = 1e-12
_WIDTH_SQUARES: Final = 128


def _zernike(value: Any) -> Any:
    """Return pairs of index and m, of such pairs or of a mapping from index to length."""
    if isinstance(value, Mapping):
        pairs = tuple((_whole(index), POSITION.parse(rms)) for index, rms in value.items())
    elif isinstance(value, tuple):
        pairs = value
    else:
        raise ValueError(f"{value!r}, expected lengths by Noll's index such as {{11: 0.2 um}}")
    seen: set[int] = set()
    for pair in pairs:
        index, rms = pair if isinstance(pair, tuple) and len(pair) == 2 else (None, None)
        if (
            not (isinstance(index, Integral) and 4 <= int(index) <= _MOST_ZERNIKE)
            or index in seen
            or not (isinstance(rms, Real) and abs(float(rms)) <= _STRONGEST)
        ):
            raise ValueError(
                f"{pair!r}, expected Noll's index, 4 to {_MOST_ZERNIKE}, each once, and its rms "
                "in m"
            )
        seen.add(index)
    return pairs


def _whole(index: object) -> Any:
    """Return the whole number written as text, as the keys of JSON are."""
    return int(index) if isinstance(index, str) and re.fullmatch("[0-9]{1,3}", index) else index


Obscuration = Annotated[
    float, Parameter("Diameter of the central obstruction, as a fraction.", least=0.0, most=0.9)
]
Defocus = Annotated[
    float,
    Parameter(
        "Distance of the surface from the plane of best focus, away from the lens.",
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
        f"Zernike aberrations by Noll's index, 4 to {_MOST_ZERNIKE}: optical path difference as\n"
        "the root of its mean square over the unobscured pupil."
    ),
]
SourceTemperature = Annotated[
    float,
    Parameter(
        "Temperature of the blackbody whose spectrum weights the wavelengths.",
        TEMPERATURE,
        least=200.0,
        most=6000.0,
    ),
]


@dataclass(frozen=True)
class PupilPSF(PointSpreadFunction):
    """Diffraction of a pupil with obscuration, defocus and aberrations, over a camera's band.

    Wavelengths count as they do in the in-band radiance of a blackbody: by the spectral radiance
    and by the band's response, relative to energy (a photon detector's is proportional to the
    wavelength, times its quantum efficiency). `fwhm` is the mean of the widths along the row and
    the column through the peak.

    Parameters
    ----------
    band : Band
        The camera's band, with its response.

    Raises
    ------
    ValueError
        If a value is impossible, or the aberrations are more than a pupil of 1024 samples across
        can hold, some 10 wavelengths.

    Notes
    -----
    With the pupil's coordinate ρ (the sine of the angle over the aperture, as an aplanatic lens
    has it), the path difference W and P = 1 within the pupil, light of the wavelength λ that leaves
    a point falls on the scene's plane with the density ``|∫ P exp(2πi (W − NA ρ·x) / λ) d²ρ|²``
    (Born and Wolf, Principles of Optics, 9.1; scalar, as the paraxial theory has it). A
    ray lands at ∇W / NA. Defocus by z is W = z (√(1 − NA² ρ²) − 1) (Hanser et al., J. Microsc. 216
    (2004) 32), and Zernike polynomials are those of Noll, J. Opt. Soc. Am. 66 (1976) 207.

    The transfer function is that of the pupil without aberrations in closed form (O'Neill, J. Opt.
    Soc. Am. 46 (1956) 285), and what they change in it, computed on a grid of the pupil. The part
    of the light far away, which falls as a / (2π r³) with a = λ / (π² NA (1 − o)) whatever the
    aberrations, is subtracted in closed form before the sum over frequencies and added after it, so
    that all light is there, however far it goes.
    """

    band: Band
    numerical_aperture: Annotated[
        float, Parameter("Numerical aperture on the scene's side.", over=0.0, most=1.0)
    ]
    obscuration: Obscuration = 0.0
    defocus: Defocus = 0.0
    zernike: Aberrations = ()
    temperature: SourceTemperature = 1000.0

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
        if self._samples > _LARGEST_PUPIL:
            raise ValueError(
                f"psf: defocus and aberrations change the path by {self._slope:.3g} m from the "
                "middle to the edge of the pupil at their steepest, expected some 10 wavelengths "
                "or less"
            )

    @cached_property
    def fwhm(self) -> float:  # type: ignore[override]
        half = _WIDTH_SQUARES
        spacing = (self._geometric + self._shortest / self.numerical_aperture) / half
        kernel = self._squares(spacing, half, half, beyond=False)
        return kernel_fwhm(kernel, spacing)

    def transfer(self, across: Array, up: Array) -> NDArray[np.complex128]:
        """Return the complex optical transfer function: 1 at zero frequency, 0 from 2 NA / λ on.

        Frequencies `across` and `up` are in 1/m and are broadcast against each other.
        """
        across, up = np.broadcast_arrays(across, up)
        frequency = np.hypot(across, up)
        found = np.zeros(frequency.shape, np.complex128)
        for wavelength, weight, change in zip(*self._spectrum, self._changes, strict=True):
            scale = wavelength / self.numerical_aperture
            passed = scale * frequency < 2.0
            part = annular_transfer(scale * frequency[passed] / 2, self.obscuration) + 0j
            if change is not None:
                step = 2.0 / self._samples
                places = np.stack([up[passed], across[passed]]) * scale / step + self._samples
                part += _interpolated(change, places)
            found[passed] += weight * part
        return found

    def in_band(self, band: Band) -> "PupilPSF":
        return replace(self, band=band)

    def kernel(self, spacing: float) -> Array:
        half = half_size(self._tail / (1 - PUPIL_ENERGY) + self._geometric, spacing)
        return self._squares(spacing, half, half, beyond=False)

    def view_kernel(self, spacing: float, rows: int, columns: int) -> Array:
        check_length("spacing", spacing)
        return normalised(self._squares(spacing, rows, columns, beyond=True))

    def _squares(self, spacing: float, rows: int, columns: int, beyond: bool) -> Array:
        """Return fractions of the light on squares; the outermost may hold what goes farther."""
        unit = self._shortest / (2 * pi * self.numerical_aperture)
        near = _NEAR * unit + 2 * self._geometric
        reach = max(near, min((max(rows, columns) + 0.5) * spacing, _FAR * unit))
        half = half_size(reach, spacing)
        core = self._core(spacing, half)
        if beyond:
            core = folded(core, rows, columns)
        core = resized(core, rows, columns)
        tail = poisson_squares(spacing, rows, columns, self._tail, self._width, beyond)
        return np.maximum(core + tail, 0.0)

    def _core(self, spacing: float, half: int) -> Array:
        """Return fractions of the light on squares less those of the tail."""
        step = 1 / (_PERIOD * (2 * half + 1) * spacing)
        count = ceil(_FINEST * 2 * self.numerical_aperture / self._shortest / step)
        up = step * np.arange(-count, count + 1, dtype=np.float64)
        across = step * np.arange(count + 1, dtype=np.float64)
        frequency = np.hypot(across, up[:, None])
        spread = 2 * pi * self._width
        tail = np.exp(-spread * frequency) * (1 + (spread - 2 * pi * self._tail) * frequency)
        image = self.transfer(across, up[:, None]) - tail
        # The image is real: frequencies to the left are in those to the right.
        image[:, 1:] *= 2.0
        place = spacing * np.arange(-half, half + 1)
        rows, columns = (
            np.exp(2j * pi * np.outer(place, f)) * np.sinc(spacing * f) for f in (up, across)
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
        """Length b in m of the tail's transfer function, see `poisson_squares`."""
        return _TAIL * self._tail * (1 - self.obscuration)

    @cached_property
    def _slope(self) -> float:
        """Largest slope of the path difference in m for one radius of the pupil."""
        x = np.linspace(-1.0, 1.0, _FINEST_PUPIL + 1)
        difference = self._path(x, x[:, None])
        steep = np.hypot(*np.gradient(difference, x[1] - x[0]))
        return float(steep[np.hypot(x, x[:, None]) <= 1.0].max())

    @property
    def _geometric(self) -> float:
        """Return the displacement of rays in the image in m."""
        return self._slope / self.numerical_aperture

    @cached_property
    def _samples(self) -> int:
        """Samples across a pupil, a power of two."""
        phase = 2 * pi * self._slope / self._shortest
        return max(_FINEST_PUPIL, 1 << ceil(log2(max(2 * phase / _COARSEST_STEP, 1.0))))

    @property
    def _changes(self) -> Iterator[NDArray[np.complex128] | None]:
        """Yield what the path difference changes in the transfer function at each wavelength.

        On steps of the pupil's samples, the middle at [samples, samples].
        """
        if not self._slope:
            yield from [None] * _WAVELENGTHS
            return
        count = self._samples
        x = (np.arange(count) - (count - 1) / 2) * 2 / count
        radius = np.hypot(x, x[:, None])
        # A sample on the edge counts as the part of it that is inside.
        pupil = np.clip((1 - radius) * count / 2 + 0.5, 0.0, 1.0)
        pupil -= np.clip((self.obscuration - radius) * count / 2 + 0.5, 0.0, 1.0)
        path = self._path(x, x[:, None])
        plain = _autocorrelation(pupil.astype(np.complex128))
        for wavelength in self._spectrum[0]:
            bent = _autocorrelation(
                np.asarray(pupil * np.exp(2j * pi / wavelength * path), np.complex128)
            )
            # Not by the middle value: there a sample on the edge counts by its square.
            yield (bent - plain) / pupil.sum()

    def _path(self, x: Array, y: Array) -> Array:
        """Return the optical path difference in m at coordinates of the pupil."""
        radius = np.hypot(x, y)
        inside = np.maximum(1 - (self.numerical_aperture * radius) ** 2, 0.0)
        path = self.defocus * (np.sqrt(inside) - 1)
        for index, rms in self.zernike:
            path = path + rms * zernike_polynomial(index, radius, np.arctan2(y, x))
        return np.asarray(path)


@PSFS.part
@dataclass(frozen=True)
class Pupil(ApertureChoice):
    """A pupil with obscuration, defocus and aberrations, over the camera's band."""

    kind = "pupil"
    example = (
        "{kind: pupil, numerical_aperture: 0.28, obscuration: 0.35, defocus: 10 um,\n"
        "    zernike: {11: 0.2 um}}"
    )
    obscuration: Obscuration = 0.0
    defocus: Defocus = 0.0
    zernike: Aberrations = ()
    temperature: SourceTemperature = 1000.0

    def for_camera(self, band: Band, magnification: float | None) -> PointSpreadFunction:
        return PupilPSF(
            band,
            self.aperture(magnification),
            self.obscuration,
            self.defocus,
            self.zernike,
            self.temperature,
        )


def annular_transfer(frequency: Array, obscuration: float) -> Array:
    """Return the transfer function of an annular pupil without aberrations.

    `frequency` is over 2 NA / λ (O'Neill, J. Opt. Soc. Am. 46 (1956) 285).
    """
    apart = 2 * frequency
    shared = (
        _shared_area(apart, 1.0, 1.0)
        - 2 * _shared_area(apart, 1.0, obscuration)
        + _shared_area(apart, obscuration, obscuration)
    )
    return np.asarray(shared / (pi * (1 - obscuration**2)))


def zernike_polynomial(index: int, radius: Array, angle: Array) -> Array:
    """Return Noll's Zernike polynomial, of mean square 1 over the unit disc.

    Polar coordinates, the angle in rad from the right: Noll, J. Opt. Soc. Am. 66 (1976) 207,
    Equations 1 to 3.
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
    """Return degree and order of Noll's index."""
    n = 0
    while (n + 1) * (n + 2) // 2 < index:
        n += 1
    place = index - n * (n + 1) // 2
    return n, 2 * (place // 2) if n % 2 == 0 else 2 * ((place - 1) // 2) + 1


def _shared_area(apart: Array, first: float, second: float) -> Array:
    """Return the area that two discs share, by their radii and the distance of their middles."""
    if second < _POINT:
        return np.zeros(apart.shape)
    d = np.clip(apart, max(abs(first - second), _POINT), first + second)
    one = np.arccos(np.clip((d**2 + first**2 - second**2) / (2 * d * first), -1, 1))
    two = np.arccos(np.clip((d**2 + second**2 - first**2) / (2 * d * second), -1, 1))
    kite = ((first + second) ** 2 - d**2) * (d**2 - (first - second) ** 2)
    area = first**2 * one + second**2 * two - np.sqrt(np.maximum(kite, 0.0)) / 2
    area = np.where(apart <= abs(first - second), pi * min(first, second) ** 2, area)
    # Rounding would leave a trace of discs that do not meet.
    return np.where(apart >= first + second, 0.0, area)


def _autocorrelation(pupil: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return ∫ P(ρ) P*(ρ + s) on steps of the samples, shape (2 n, 2 n), s = 0 at [n, n]."""
    twice = [2 * count for count in pupil.shape]
    power = np.abs(fft.fft2(pupil, twice)) ** 2
    return np.asarray(fft.fftshift(np.conj(fft.ifft2(power))))


def _interpolated(values: NDArray[np.complex128], places: Array) -> NDArray[np.complex128]:
    return np.asarray(map_coordinates(values, places, order=3, mode="grid-constant"))
