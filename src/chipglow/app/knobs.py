"""The knobs of the app: what they are called, how a study writes them, and the study they mean."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from chipglow.camera import EquivalentNoise, GaussianPSF
from chipglow.quantities.units import (
    INSTANT,
    LENGTH,
    POSITION,
    TEMPERATURE,
    TEMPERATURE_DIFFERENCE,
    TIME,
    WAVELENGTH,
    Quantity,
)
from chipglow.scene import Raster, Scene
from chipglow.study import Study
from chipglow.study.analysis_section import AnalysisSection
from chipglow.study.camera_section import CameraSection
from chipglow.study.surface_section import FeaturesSection, surface_names
from chipglow.surface import CHIP_1, UniformEmissivity
from chipglow.text.description import problem

Point: TypeAlias = tuple[float, float]
Ends: TypeAlias = tuple[Point, Point]

_BARE: Final = re.compile(r"[-+−]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.IGNORECASE)

OWN: Final = "own numbers"
UNIFORM: Final = "uniform"
STUDYS: Final = "study's"
"""A point spread function or noise that the app has no knobs for: it stays as the study has it."""

SHOWN: Final[Mapping[str, str]] = {
    "temperature": "True temperature",
    "radiance_temperature": "Radiance temperature",
    "emissivity": "Emissivity",
    "plastic_strain": "Plastic strain",
    "plastic_strain_rate": "Plastic strain rate",
    "speed": "Speed",
}
"""What the image of the scene may show."""

ERRORS: Final[Mapping[str, str]] = {
    "total": "Error",
    "motion": "Error by motion",
    "footprint": "Error by footprint",
    "psf": "Error by PSF",
    "texture": "Error by texture",
}
"""What the image of the error may show: the whole of it, or a part."""

LINES: Final = ("rake_line", "band_line")
LINE_NAMES: Final[Mapping[str, str]] = {
    "rake_line": "across the rake face",
    "band_line": "across the shear band",
}
CURSOR: Final = "cursor"

_ROUNDED: Final = 1e-7
"""Places of cursor and lines are written to a tenth of a micrometre."""

NOISE_TEMPERATURE: Final = 573.15
"""Temperature in K of the blackbody at which the noise is stated: the paper's lower range limit."""


@dataclass(frozen=True)
class Knob:
    """One knob, as the page shows it.

    Parameters
    ----------
    name : str
        Field of `Knobs`.
    label : str
        What the page calls it.
    group : str
        Under which heading it stands.
    quantity : Quantity or None
        How its value is written; None for a plain number or a word.
    low, high, step : float
        Ends and step of its slider, in the unit of `quantity`. What is typed may be beyond; the
        study's own limits count.
    choices : mapping
        What a knob may be that is a word, and what the page calls it.
    optional : bool
        Whether it may be none.
    whole : bool
        Whether it is a whole number.
    stops : tuple of float
        Values in SI at which its slider stops, where they are not evenly spaced.
    """

    name: str
    label: str
    group: str
    quantity: Quantity | None = None
    low: float = 0.0
    high: float = 1.0
    step: float = 0.01
    choices: Mapping[str, str] | None = None
    optional: bool = False
    whole: bool = False
    stops: tuple[float, ...] = ()

    def text(self, value: Any) -> str:
        """A value as links and the page write it."""
        if value is None:
            return "none"
        if self.quantity is not None:
            return self.quantity.text(value)
        return str(value) if self.choices or self.whole else f"{value:.10g}"

    def number(self, value: Any) -> str:
        """The same without the unit; empty for none."""
        if value is None:
            return ""
        text = self.text(value)
        return text if self.choices else text.split(" ")[0]

    def value(self, text: str) -> Any:
        """The value of a text, with or without the knob's own unit.

        Raises
        ------
        ValueError
            If it is none; the message names the knob.
        """
        written = text.strip()
        if self.optional and written in ("", "none"):
            return None
        if self.choices is not None:
            if written not in self.choices:
                raise ValueError(f"{self.label}: {written!r}, expected {', '.join(self.choices)}")
            return written
        try:
            if self.whole:
                return int(written)
            if self.quantity is None:
                return float(written)
            bare = f"{written} {self.quantity.unit}" if _BARE.fullmatch(written) else written
            return self.quantity.parse(bare)
        except ValueError as error:
            kind = "a whole number" if self.whole else "a number"
            wanted = str(error) if self.quantity else f"{written!r}, expected {kind}"
            raise ValueError(f"{self.label}: {wanted}") from None


@dataclass(frozen=True)
class Knobs:
    """The state of the app, in SI units: all that its picture depends on.

    Parameters
    ----------
    start : float
        When the exposure begins in s.
    shown, error : str
        What the images of scene and error show, of `SHOWN` and `ERRORS`.
    band_lower, band_upper, pitch, integration_time, offset_right, offset_down, psf_order, \
lower_limit, reflected
        As the fields of a study's camera.
    psf : str
        ``annular-aperture``, ``gaussian``, ``none`` or `STUDYS`.
    numerical_aperture, fwhm : float
        Of the one or the other.
    netd : float
        Noise in K at `NOISE_TEMPERATURE`; 0 for none, −1 for that of the study's detector.
    surface : str
        Name of one of the study's surfaces, `OWN` or `UNIFORM`.
    body_mean, body_deviation, band_mean, band_deviation : float
        Emissivity of the chip and of its shear bands where the surface is `OWN`.
    emissivity : float
        Where it is `UNIFORM`.
    seed : int
        Of textures and noise.
    cursor : tuple of float
        Where numbers are read, x and y in m.
    rake_line, band_line : tuple of tuple
        Ends of the lines.
    """

    start: float
    shown: str
    error: str
    band_lower: float
    band_upper: float
    pitch: float
    integration_time: float
    offset_right: float
    offset_down: float
    psf: str
    numerical_aperture: float
    fwhm: float
    psf_order: Literal["optics", "detector"]
    netd: float
    lower_limit: float | None
    reflected: float | None
    surface: str
    body_mean: float
    body_deviation: float
    band_mean: float
    band_deviation: float
    emissivity: float
    seed: int
    cursor: Point
    rake_line: Ends
    band_line: Ends

    def points(self, name: str) -> tuple[Point, ...]:
        """The cursor, or the ends of one of the lines, by its name."""
        return (self.cursor,) if name == CURSOR else getattr(self, name)


def knobs_of(study: Study, start: float, cursor: Point, rake: Ends, band: Ends) -> Knobs:
    """The knobs that mean a study.

    Parameters
    ----------
    study : Study
        Surface and camera.
    start : float
        When the exposure begins in s.
    cursor, rake, band
        Cursor and lines.
    """
    camera, psf = study.camera, study.camera.psf
    kind = "none" if psf is None else str(psf.kind)
    own = {"annular-aperture": "numerical_aperture", "gaussian": "fwhm"}
    return Knobs(
        start=start,
        shown="temperature",
        error="total",
        band_lower=camera.band[0],
        band_upper=camera.band[1],
        pitch=camera.pitch,
        integration_time=camera.integration_time,
        offset_right=camera.offset_right,
        offset_down=camera.offset_down,
        psf=kind if kind in own or psf is None else STUDYS,
        numerical_aperture=getattr(psf, "numerical_aperture", 0.28),
        fwhm=psf.fwhm if isinstance(psf, GaussianPSF) else 8e-6,
        psf_order=camera.psf_order,
        netd=_netd(camera),
        lower_limit=camera.build().lower_limit,
        reflected=camera.reflected,
        surface=surface_names(study.surface)[0],
        body_mean=CHIP_1.chip.mean,
        body_deviation=CHIP_1.chip.standard_deviation,
        band_mean=CHIP_1.shear_band.mean,
        band_deviation=CHIP_1.shear_band.standard_deviation,
        emissivity=0.5,
        seed=study.seed,
        cursor=cursor,
        rake_line=rake,
        band_line=band,
    )


def _netd(camera: CameraSection) -> float:
    """Noise of a camera, if its detector is one that the knob makes."""
    if camera.detector is None:
        return 0.0
    terms = camera.detector.terms
    (only,) = terms if len(terms) == 1 else (None,)
    netd = only.netd if isinstance(only, EquivalentNoise) else -1.0
    return netd if netd > 0 and camera.detector == _noisy(netd) else -1.0


def _noisy(netd: float) -> Any:
    """Section of a detector with noise, and steps so fine that they do not count."""
    return CameraSection.model_validate(
        {"detector": _detector(netd), "lower_limit": "none"}
    ).detector


def _detector(netd: float) -> dict[str, Any]:
    return {
        "response": {"kind": "range", "hottest": "2500 degC"},
        "full_well": 1e9,
        "bits": 28,
        "terms": [
            {
                "kind": "netd",
                "netd": TEMPERATURE_DIFFERENCE.text(netd),
                "temperature": TEMPERATURE.text(NOISE_TEMPERATURE),
            }
        ],
    }


_WHEN: Final = {
    "numerical_aperture": ("psf", "annular-aperture"),
    "fwhm": ("psf", "gaussian"),
    "body_mean": ("surface", OWN),
    "body_deviation": ("surface", OWN),
    "band_mean": ("surface", OWN),
    "band_deviation": ("surface", OWN),
    "emissivity": ("surface", UNIFORM),
}
"""Knobs that only count, and are only there, while another knob has a value."""


def counts(knob: Knob, knobs: Knobs) -> bool:
    """Whether a knob counts beside the others."""
    name, value = _WHEN.get(knob.name, ("", ""))
    return not name or bool(getattr(knobs, name) == value)


@dataclass(frozen=True)
class ControlPanel:
    """The knobs of one study on one scene, and how they become the study again.

    Parameters
    ----------
    study : Study
        What the knobs change.
    initial : Knobs
        The knobs that mean it.
    knobs : tuple of Knob
        In the order of the page.
    extent : tuple of float
        Where cursor and lines may be: left, right, bottom and top in m.
    """

    study: Study
    initial: Knobs
    knobs: tuple[Knob, ...]
    extent: tuple[float, float, float, float]

    @classmethod
    def of(cls, study: Study, scene: Scene, initial: Knobs, duration: float) -> "ControlPanel":
        """The knobs for a scene with sliders as long as it, in which a frame takes a duration."""
        knobs = tuple(_knobs(study, scene, initial, duration))
        return cls(study, initial, knobs, scene.raster.extent)

    @classmethod
    def of_times(cls, initial: Knobs, times: NDArray[np.float64], raster: Raster) -> "ControlPanel":
        """The knob of a measurement: which of its frames is seen."""
        return cls(Study(), initial, (_time_knob("Frame began", times),), raster.extent)

    def knob(self, name: str) -> Knob:
        """The knob of a name."""
        return next(knob for knob in self.knobs if knob.name == name)

    def changed(self, knobs: Knobs, texts: Mapping[str, str]) -> Knobs:
        """Knobs with some of them set by their text; what they then mean is checked.

        Raises
        ------
        ValueError
            If a text is no such value, or the study's own limits forbid it.
        """
        known = {knob.name: knob for knob in self.knobs}
        changes: dict[str, Any] = {}
        for name, text in texts.items():
            if name in known:
                changes[name] = known[name].value(text)
            elif name == CURSOR:
                changes[name] = self._points("Cursor", text, 1)[0]
            elif name in LINES:
                changes[name] = self._points(f"Line {LINE_NAMES[name]}", text, 2)
            else:
                raise ValueError(f"{name}: unknown knob, expected one of {', '.join(known)}")
        new = replace(knobs, **changes)
        try:
            self.study_of(new)
        except ValueError as error:
            raise ValueError(f"{self.named(texts)}: {error}") from None
        return new

    def named(self, texts: Mapping[str, str]) -> str:
        """Knobs and what they are set to, as a message names them."""
        labels = {CURSOR: "Cursor", **{name: f"Line {LINE_NAMES[name]}" for name in LINES}}
        labels |= {knob.name: knob.label for knob in self.knobs}
        return ", ".join(f"{labels[name]} {text}" for name, text in texts.items())

    def _points(self, name: str, text: str, count: int) -> Any:
        """Points of a text such as ``-35,120;20,140`` in µm, that are in the image."""
        found = _points(name, text, count)
        left, right, bottom, top = self.extent
        for x, y in found:
            if not (
                left - _ROUNDED <= x <= right + _ROUNDED
                and bottom - _ROUNDED <= y <= top + _ROUNDED
            ):
                ends = [f"{1e6 * end:.1f}" for end in self.extent]
                raise ValueError(
                    f"{name}: {text}, expected x from {ends[0]} to {ends[1]} µm and y from "
                    f"{ends[2]} to {ends[3]} µm"
                )
        return found

    def texts(self, knobs: Knobs) -> dict[str, str]:
        """The knobs that differ from the first ones, as a link writes them."""
        known = {knob.name: knob for knob in self.knobs}
        found = {}
        for one in fields(knobs):
            value = getattr(knobs, one.name)
            if value == getattr(self.initial, one.name):
                continue
            found[one.name] = known[one.name].text(value) if one.name in known else _text(value)
        return found

    def study_of(self, knobs: Knobs) -> Study:
        """The study that the knobs mean: what they do not say is as in the first one.

        Raises
        ------
        ValueError
            If it is not possible; the message names the field.
        """
        last = self._made.get("last")
        if last is not None and last[0] == knobs:
            return last[1]
        try:
            sections = {
                "seed": knobs.seed,
                "camera": self._camera(knobs),
                "surface": self._surface(knobs),
                "analysis": self._analysis(knobs),
            }
        except ValidationError as error:
            raise ValueError(problem(error)) from None
        study = self.study.model_copy(update=sections)
        self._made["last"] = knobs, study
        return study

    def _differs(self, knobs: Knobs, *names: str) -> bool:
        return any(getattr(knobs, name) != getattr(self.initial, name) for name in names)

    def _camera(self, knobs: Knobs) -> CameraSection:
        changes: dict[str, Any] = {}
        if self._differs(knobs, "band_lower", "band_upper"):
            ends = (knobs.band_lower, knobs.band_upper)
            first, last = (WAVELENGTH.text(one).split()[0] for one in ends)
            changes["band"] = f"{first}-{last} um"
        if self._differs(knobs, "pitch"):
            changes |= {"pitch": LENGTH.text(knobs.pitch), "detector_pitch": "none"}
        for name, quantity in (
            ("offset_right", POSITION),
            ("offset_down", POSITION),
            ("integration_time", TIME),
            ("lower_limit", TEMPERATURE),
            ("reflected", TEMPERATURE),
        ):
            if self._differs(knobs, name):
                value = getattr(knobs, name)
                changes[name] = "none" if value is None else quantity.text(value)
        if self._differs(knobs, "psf_order"):
            changes["psf_order"] = knobs.psf_order
        if self._differs(knobs, "psf", "numerical_aperture", "fwhm"):
            changes["psf"] = self._psf(knobs)
            changes["blur"] = [] if knobs.psf == "none" else self._written["blur"]
        if self._differs(knobs, "netd") and knobs.netd >= 0:
            changes["detector"] = _detector(knobs.netd) if knobs.netd else "none"
            if knobs.lower_limit is not None:
                changes["lower_limit"] = TEMPERATURE.text(knobs.lower_limit)
        if not changes:
            return self.study.camera
        return CameraSection.model_validate({**self._written, **changes})

    @cached_property
    def _written(self) -> dict[str, Any]:
        """The camera as a study writes it."""
        return self.study.camera.model_dump(mode="json")

    @cached_property
    def _made(self) -> dict[str, tuple[Knobs, Study]]:
        """The study that was made last, with its knobs: it is asked for several times."""
        return {}

    def _psf(self, knobs: Knobs) -> Any:
        written = self._written["psf"]
        if knobs.psf == STUDYS:
            return written
        if knobs.psf == "none":
            return "none"
        if knobs.psf == "gaussian":
            return {"kind": "gaussian", "fwhm": LENGTH.text(knobs.fwhm)}
        same = isinstance(written, Mapping) and written.get("kind") == knobs.psf
        kept = written if same else {"kind": knobs.psf}
        return {**kept, "numerical_aperture": knobs.numerical_aperture}

    def _surface(self, knobs: Knobs) -> Any:
        section = self.study.surface
        if knobs.surface == UNIFORM:
            return UniformEmissivity(knobs.emissivity)
        if not isinstance(section, FeaturesSection):
            return section
        if knobs.surface != OWN:
            chosen = {}
            for kind in ("chips", "maps", "measured"):
                named = getattr(section, kind)
                chosen[kind] = {name: named[name] for name in named if name == knobs.surface}
            return section.model_copy(update=chosen)
        written = section.model_dump(mode="json")
        own = {
            "body": {"mean": knobs.body_mean, "standard_deviation": knobs.body_deviation},
            "shear_band": {"mean": knobs.band_mean, "standard_deviation": knobs.band_deviation},
        }
        return FeaturesSection.model_validate(
            {**written, "chips": {OWN: own}, "maps": {}, "measured": {}}
        )

    def _analysis(self, knobs: Knobs) -> AnalysisSection:
        lines = {LINE_NAMES[name]: getattr(knobs, name) for name in LINES}
        return self.study.analysis.model_copy(
            update={
                "points": {CURSOR: knobs.cursor},
                "lines": lines,
                "rake_chip": knobs.surface,
                "band_chip": knobs.surface,
            }
        )


def surface_choices(study: Study) -> dict[str, str]:
    """What the surface may be, and what the page calls it."""
    found = {name: name.capitalize() for name in surface_names(study.surface)}
    own = {OWN: "Own numbers"} if isinstance(study.surface, FeaturesSection) else {}
    return {**found, **own, UNIFORM: "Uniform"}


def _knobs(study: Study, scene: Scene, initial: Knobs, duration: float) -> Any:
    psfs = {
        "annular-aperture": "Annular aperture",
        "gaussian": "Gaussian",
        "none": "None (ideal)",
    }
    if initial.psf == STUDYS:
        psfs[STUDYS] = "As in the study"
    side = 1e6 * scene.raster.spacing * min(scene.raster.shape)
    shown = {k: v for k, v in SHOWN.items() if _is_there(k, scene)}
    yield _time_knob("Exposure begins", _starts(scene, duration))
    yield Knob("shown", "Scene image", "Scene", choices=shown)
    yield Knob("error", "Error image", "Scene", choices=ERRORS)
    yield Knob("band_lower", "Band from", "Camera", WAVELENGTH, 0.8, 8.0, 0.1)
    yield Knob("band_upper", "Band to", "Camera", WAVELENGTH, 1.0, 14.0, 0.1)
    yield Knob("pitch", "Pixel pitch", "Camera", LENGTH, 1.0, min(30.0, side), 0.5)
    longest = 5e6 * initial.integration_time
    yield Knob("integration_time", "Exposure", "Camera", TIME, longest / 50, longest, longest / 100)
    yield Knob("offset_right", "Pixels right", "Camera", POSITION, 0.0, 12.0, 0.5)
    yield Knob("offset_down", "Pixels down", "Camera", POSITION, 0.0, 12.0, 0.5)
    yield Knob("psf", "PSF", "Optics", choices=psfs)
    yield Knob("numerical_aperture", "Numerical aperture", "Optics", None, 0.1, 0.7, 0.01)
    yield Knob("fwhm", "PSF width (FWHM)", "Optics", LENGTH, 1.0, 30.0, 0.5)
    orders = {"detector": "Blur on the pixels", "optics": "Blur on the scene"}
    yield Knob("psf_order", "Order", "Optics", choices=orders)
    if initial.netd >= 0:
        noise = TEMPERATURE_DIFFERENCE
        yield Knob("netd", "Noise (NETD at 300 °C)", "Detector", noise, 0.0, 5.0, 0.05)
    limit = ("Lower range limit", "Detector", TEMPERATURE, 0.0, 800.0, 10.0)
    yield Knob("lower_limit", *limit, optional=True)
    surfaces = surface_choices(study)
    yield Knob("surface", "Emissivity", "Surface", choices=surfaces)
    yield Knob("body_mean", "Chip, mean", "Surface", None, 0.05, 1.0, 0.01)
    yield Knob("body_deviation", "Chip, std. deviation", "Surface", None, 0.0, 0.2, 0.005)
    yield Knob("band_mean", "Shear band, mean", "Surface", None, 0.05, 1.0, 0.01)
    yield Knob("band_deviation", "Shear band, std. dev.", "Surface", None, 0.0, 0.2, 0.005)
    yield Knob("emissivity", "Uniform emissivity", "Surface", None, 0.05, 1.0, 0.01)
    yield Knob("seed", "Seed", "Surface", None, 0, 4000, 1, whole=True)
    around = ("Reflected temperature", "Surface", TEMPERATURE, 0.0, 300.0, 5.0)
    yield Knob("reflected", *around, optional=True)


def _time_knob(label: str, times: NDArray[np.float64]) -> Knob:
    ends = 1e6 * float(times[0]), 1e6 * float(times[-1])
    stops = tuple(float(f"{time:.9g}") for time in times)
    return Knob("start", label, "Scene", INSTANT, *ends, stops=stops)


def _starts(scene: Scene, duration: float) -> NDArray[np.float64]:
    """Frames with which an exposure can begin that ends before the scene or a part of it does."""
    times, spacing = scene.times, scene.frame_spacing
    if len(times) == 1:
        return times
    fits = [
        times[i]
        for block in scene.blocks
        for i in block
        if times[i] + duration <= times[block[-1]] + spacing * (1 + 1e-6)
    ]
    return np.array(fits)


def _is_there(shown: str, scene: Scene) -> bool:
    needed = {"radiance_temperature": "temperature", "emissivity": "temperature"}
    name = "velocity_x" if shown == "speed" else needed.get(shown, shown)
    return name in scene.fields


def _points(name: str, text: str, count: int) -> Any:
    """Points of a text such as ``-35,120;20,140`` in µm."""
    try:
        found = tuple(
            (POSITION.parse(f"{x.strip()} um"), POSITION.parse(f"{y.strip()} um"))
            for x, y in (one.split(",") for one in text.split(";"))
        )
    except ValueError:
        raise ValueError(f"{name}: {text!r}, expected positions such as -35,120 in µm") from None
    if len(found) != count or (count == 2 and found[0] == found[1]):
        raise ValueError(f"{name}: {text!r}, expected {count} different points")
    return found


def _text(value: Any) -> str:
    points = value if isinstance(value[0], tuple) else (value,)
    return ";".join(f"{1e6 * x:.6g},{1e6 * y:.6g}" for x, y in points)
