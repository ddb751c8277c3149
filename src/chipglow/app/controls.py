"""The controls of the app: rows that name a setting of the study, and the study at their values."""

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from types import NoneType
from typing import Any, Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import changed, setting_at, unchecked, value_at
from chipglow.quantities.units import INSTANT, POSITION, Quantity
from chipglow.scene import Raster, Scene
from chipglow.study import Study
from chipglow.study.surface_section import FeaturesSection, surface_names
from chipglow.surface import UniformEmissivity

Point: TypeAlias = tuple[float, float]
Corners: TypeAlias = tuple[Point, Point]
Texts: TypeAlias = Mapping[str, str]
"""Values of controls by their paths, as a link writes them; those not given are the first ones."""

Stage: TypeAlias = Literal["surface", "exposure", "pixels", "optics", "reading", "view"]
"""First part of the computation of a picture that a control changes."""

STAGES: Final = get_args(Stage)

CURSOR: Final = "cursor"
LINES: Final[Mapping[str, str]] = {
    "rake_line": "across the rake face",
    "band_line": "across the shear band",
}
"""The lines, and their names in a study."""

SCENE_IMAGES: Final[Mapping[str, str]] = {
    "temperature": "True temperature",
    "radiance_temperature": "Radiance temperature",
    "emissivity": "Emissivity",
    "plastic_strain": "Plastic strain",
    "plastic_strain_rate": "Plastic strain rate",
    "speed": "Speed",
}
ERROR_IMAGES: Final[Mapping[str, str]] = {
    "total": "Error",
    "motion": "Error by motion",
    "footprint": "Error by footprint",
    "psf": "Error by PSF",
    "texture": "Error by texture",
}

OWN: Final = "own numbers"
AS_STUDY: Final = "study"
_NOISE: Final = {
    "response": {"kind": "range", "hottest": "2500 degC"},
    "full_well": 1e9,
    "bits": 28,
    "terms": [{"kind": "netd", "netd": "0.1 K", "temperature": "300 degC"}],
}
"""A detector with this noise and steps too fine to matter."""

_BARE: Final = re.compile(r"[-+−]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.IGNORECASE)
_PLACE_STEP: Final = 0.1
"""Resolution of positions in µm."""


@dataclass(frozen=True)
class Option:
    """A word that a control may have: its label, and the settings that it means."""

    label: str
    changes: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Control:
    """A row of the table. Ends and step of the slider are in the unit of the setting."""

    path: str
    label: str
    group: str
    stage: Stage
    low: float = 0.0
    high: float = 1.0
    step: float = 0.01
    options: Mapping[str, Option] = field(default_factory=dict)
    stops: tuple[float, ...] = ()
    quantity: Quantity | None = None
    optional: bool = False
    whole: bool = False

    @property
    def unit(self) -> str:
        """Unit as a page shows it; empty for none."""
        unit = self.quantity.unit if self.quantity else ""
        return {"um": "µm", "us": "µs", "degC": "°C"}.get(unit, unit)

    def text(self, value: Any) -> str:
        """Return a value as links write it."""
        if value is None:
            return "none"
        if self.quantity is not None:
            return _quantity_text(self.quantity, value)
        return str(value) if self.options or self.whole else f"{value:.10g}"

    def number(self, value: Any) -> str:
        """Return a value without its unit; empty for none."""
        if self.options or value is None:
            return value or ""
        return self.text(value).split(" ")[0]

    def value(self, text: str) -> Any:
        """Return the value in SI of a text, with or without its unit."""
        written = text.strip()
        if self.optional and written in ("", "none"):
            return None
        if self.options:
            if written not in self.options:
                raise ValueError(f"{self.label}: {written!r}, expected {', '.join(self.options)}")
            return written
        number = written.replace(",", ".")
        try:
            if self.whole:
                return int(number)
            if self.quantity is None:
                return float(number)
            bare = f"{number} {self.quantity.unit}" if _BARE.fullmatch(number) else written
            return self.quantity.parse(bare)
        except ValueError as error:
            kind = "a whole number" if self.whole else "a number"
            expected = str(error) if self.quantity else f"{written!r}, expected {kind}"
            raise ValueError(f"{self.label}: {expected}") from None


TABLE: Final = (
    Control("start", "Exposure begins", "Scene", "exposure", quantity=INSTANT),
    Control("scene_image", "Scene image", "Scene", "view"),
    Control("error_image", "Error image", "Scene", "view"),
    Control("camera.band.0", "Band from", "Camera", "exposure", 0.8, 8.0, 0.1),
    Control("camera.band.1", "Band to", "Camera", "exposure", 1.0, 14.0, 0.1),
    Control("camera.pitch", "Pixel pitch", "Camera", "pixels", 1.0, 30.0, 0.5),
    Control("camera.integration_time", "Exposure", "Camera", "exposure", 1.0, 50.0, 0.5),
    Control("camera.offset_right", "Pixels right", "Camera", "pixels", 0.0, 12.0, 0.5),
    Control("camera.offset_down", "Pixels down", "Camera", "pixels", 0.0, 12.0, 0.5),
    Control("camera.psf", "PSF", "Optics", "optics"),
    Control("camera.psf.numerical_aperture", "Numerical aperture", "Optics", "optics", 0.1, 0.7),
    Control("camera.psf.fwhm", "PSF width (FWHM)", "Optics", "optics", 1.0, 30.0, 0.5),
    Control("camera.psf_order", "Order", "Optics", "optics"),
    Control("camera.detector", "Detector", "Detector", "reading"),
    Control("camera.detector.terms.0.netd", "Noise (NETD)", "Detector", "reading", 0.05, 5.0, 0.05),
    Control("camera.lower_limit", "Lower range limit", "Detector", "reading", 0.0, 800.0, 10.0),
    Control("surface", "Emissivity", "Surface", "surface"),
    Control(f"surface.chips.{OWN}.body.mean", "Chip, mean", "Surface", "surface", 0.05),
    Control(
        f"surface.chips.{OWN}.body.standard_deviation",
        "Chip, std. deviation", "Surface", "surface", 0.0, 0.2, 0.005,
    ),
    Control(f"surface.chips.{OWN}.shear_band.mean", "Shear band, mean", "Surface", "surface", 0.05),
    Control(
        f"surface.chips.{OWN}.shear_band.standard_deviation",
        "Shear band, std. dev.", "Surface", "surface", 0.0, 0.2, 0.005,
    ),
    Control("surface.emissivity", "Uniform emissivity", "Surface", "surface", 0.05),
    Control("seed", "Seed", "Surface", "surface", 0, 4000, 1),
    Control("camera.reflected", "Reflected temperature", "Surface", "exposure", 0.0, 300.0, 5.0),
)  # fmt: skip
"""All controls in the order of the page. A control is shown while the study has its setting."""

_VIEW: Final = ("start", "scene_image", "error_image")
"""Controls of the page itself, which are no settings of a study."""


@dataclass(frozen=True)
class State:
    """The study and the view at some values of the controls; all that a picture depends on."""

    texts: Texts
    study: Study = field(compare=False)
    start: float
    scene_image: str
    error_image: str

    @property
    def cursor(self) -> Point:
        """Position at which numbers are read in m."""
        return self.study.analysis.points[CURSOR]

    def line(self, name: str) -> Corners:
        """Ends of one of `LINES` in m."""
        return self.study.analysis.lines[LINES[name]]  # type: ignore[return-value]

    def place(self, name: str) -> tuple[Point, ...]:
        """The cursor or the ends of a line in m."""
        return (self.cursor,) if name == CURSOR else self.line(name)


@dataclass(frozen=True, eq=False)
class Controls:
    """The controls of a study on a scene or of a measurement, and the state at their values."""

    study: Study
    start: float
    extent: tuple[float, float, float, float]
    rows: tuple[Control, ...]

    @classmethod
    def of_scene(cls, study: Study, scene: Scene, start: float, duration: float) -> "Controls":
        """Return the controls of a scene; one exposure lasts `duration`."""
        options = _options(study, scene)
        studies = [
            _with(study, one.changes) for words in options.values() for one in words.values()
        ]
        side = 1e6 * scene.raster.spacing * min(scene.raster.shape)
        longest = 5e6 * study.camera.integration_time
        ranges: dict[str, dict[str, Any]] = {
            "start": {"stops": tuple(_starts(scene, duration))},
            "camera.pitch": {"high": min(30.0, side)},
            "camera.integration_time": {
                "low": longest / 50, "high": longest, "step": longest / 100
            },
        }  # fmt: skip
        rows = []
        for row in TABLE:
            made = replace(row, options=options.get(row.path, {}), **ranges.get(row.path, {}))
            if row.path not in options and row.path not in _VIEW:
                having = [one for one in studies if _has(one, row.path)]
                if not having:
                    continue
                setting = setting_at(having[0], row.path)
                made = replace(
                    made,
                    quantity=setting.parameter.quantity,
                    optional=NoneType in get_args(setting.kind),
                    whole=setting.kind is int,
                )
            rows.append(made)
        return cls(study, start, scene.raster.extent, tuple(rows))

    @classmethod
    def of_measurement(cls, study: Study, times: NDArray[np.float64], raster: Raster) -> "Controls":
        """Return the only control of a measurement: which of its frames is shown."""
        row = replace(TABLE[0], label="Frame began", stops=tuple(map(rounded, times)))
        return cls(study, row.stops[0], raster.extent, (row,))

    @cached_property
    def initial(self) -> State:
        """The state at the first values."""
        return self.state({})

    @cached_property
    def _by_path(self) -> dict[str, Control]:
        return {row.path: row for row in self.rows}

    def row(self, path: str) -> Control:
        """Return the control of a path."""
        return self._by_path[path]

    def key(self, state: State, last: Stage) -> tuple[str | None, ...]:
        """Return the values that decide about the stages of a picture up to the last one."""
        known = STAGES[: STAGES.index(last) + 1]
        return tuple(state.texts.get(row.path) for row in self.rows if row.stage in known)

    def is_shown(self, row: Control, state: State) -> bool:
        """Whether the study has the setting of a control."""
        return row.path in _VIEW or _has(state.study, row.path)

    def value(self, row: Control, state: State) -> Any:
        """Return the value of a control: a word, or a number in SI."""
        if row.options:
            return state.texts.get(row.path, next(iter(row.options)))
        if row.path == "camera.lower_limit":
            return state.study.camera.build().lower_limit
        if row.path == "start":
            return state.start
        return value_at(state.study, row.path) if _has(state.study, row.path) else None

    def values(self, state: State) -> dict[str, str]:
        """Return the texts of all controls and places as the page shows them."""
        places = (CURSOR, *LINES)
        texts = {row.path: row.number(self.value(row, state)) for row in self.rows}
        return texts | {name: places_text(state.place(name), ", ", "; ") for name in places}

    def changed(self, state: State, texts: Texts) -> State:
        """Return the state with some controls at other values.

        Raises
        ------
        ValueError
            If a text is no such value, or the study does not allow it.
        """
        new = dict(state.texts)
        for path, text in texts.items():
            if path in (CURSOR, *LINES):
                new[path] = self._place(path, text)
            elif path in self._by_path:
                row = self._by_path[path]
                new[path] = row.text(row.value(text))
            else:
                known = ", ".join(self._by_path)
                raise ValueError(f"{path}: unknown control, expected one of {known}")
            if new[path] == self._first_text(path):
                del new[path]
        try:
            return self.state(new)
        except ValueError as error:
            raise ValueError(f"{self.named(texts)}: {error}") from None

    def named(self, texts: Texts) -> str:
        """Return controls and their new values as a message names them."""
        return ", ".join(f"{self._label(path)} {text}" for path, text in texts.items())

    def _label(self, path: str) -> str:
        if path == CURSOR:
            return "Cursor"
        return f"Line {LINES[path]}" if path in LINES else self._by_path[path].label

    def state(self, texts: Texts) -> State:
        """Return the state at given values; the first ones where none is given."""
        words = {row.path: texts.get(row.path, next(iter(row.options), "")) for row in self.rows}
        study = self.study
        for row in self.rows:
            if row.options and row.options[words[row.path]].changes:
                study = _with(study, row.options[words[row.path]].changes)
        numbers = {
            path: row.value(texts[path])
            for path, row in self._by_path.items()
            if path in texts and not row.options and path not in _VIEW
            and _has(study, path)
        }  # fmt: skip
        if numbers:
            study = _with(study, numbers)
        start = self.row("start").value(texts["start"]) if "start" in texts else self.start
        return State(
            texts,
            unchecked(study, analysis=self._analysis(study, texts)),
            start,
            words.get("scene_image", ""),
            words.get("error_image", ""),
        )

    def _analysis(self, study: Study, texts: Texts) -> Any:
        """Return the section of the analysis, with cursor and lines as its places."""
        given = study.analysis
        cursor = _places(texts[CURSOR])[0] if CURSOR in texts else given.points[CURSOR]
        lines = {
            title: _places(texts[name]) if name in texts else given.lines[title]
            for name, title in LINES.items()
        }
        return unchecked(given, points={CURSOR: cursor}, lines=lines)

    def _first_text(self, path: str) -> str:
        if path in (CURSOR, *LINES):
            return places_text(self.initial.place(path))
        row = self._by_path[path]
        return row.text(self.value(row, self.initial)) if self.is_shown(row, self.initial) else ""

    def _place(self, name: str, text: str) -> str:
        """Return the text of points within the image."""
        label, count = self._label(name), 1 if name == CURSOR else 2
        try:
            places = tuple(dict.fromkeys(_places(text)))
        except ValueError:
            expected = "expected positions such as -35,120 in µm"
            raise ValueError(f"{label}: {text!r}, {expected}") from None
        if len(places) != count:
            raise ValueError(f"{label}: {text!r}, expected {count} different points")
        left, right, bottom, top = (1e6 * edge for edge in self.extent)
        for x, y in places:
            outside = max(left - 1e6 * x, 1e6 * x - right, bottom - 1e6 * y, 1e6 * y - top)
            if outside > _PLACE_STEP:
                raise ValueError(
                    f"{label}: {text}, expected x from {left:.1f} to {right:.1f} µm and y from "
                    f"{bottom:.1f} to {top:.1f} µm"
                )
        return places_text(places)


@lru_cache(1000)
def _quantity_text(quantity: Quantity, value: float) -> str:
    """Return the text of a value; most of them are the same at the next state."""
    return quantity.text(value)


def places_text(places: tuple[Point, ...], comma: str = ",", between: str = ";") -> str:
    """Return the text of positions in µm."""
    return between.join(f"{1e6 * x:.1f}{comma}{1e6 * y:.1f}" for x, y in places)


def _places(text: str) -> Any:
    pairs = (one.split(",") for one in text.split(";"))
    return tuple(tuple(POSITION.parse(f"{one.strip()} um") for one in (x, y)) for x, y in pairs)


def _has(study: Study, path: str) -> bool:
    with suppress(LookupError):
        value_at(study, path)
        return True
    return False


def _with(study: Study, changes: Mapping[str, object]) -> Study:
    """Return a study with other settings; its cut need not suit them, as the scene is there."""
    update: dict[str, Any] = {path: value for path, value in changes.items() if "." not in path}
    for name in dict.fromkeys(path.partition(".")[0] for path in changes if "." in path):
        inner = {
            path.removeprefix(f"{name}."): value
            for path, value in changes.items()
            if path.startswith(f"{name}.")
        }
        update[name] = changed(update.get(name, getattr(study, name)), inner)
    return unchecked(study, **update)


def _options(study: Study, scene: Scene) -> dict[str, dict[str, Option]]:
    """Return the words of the controls that have some, the study's own one first."""
    camera, psf = study.camera, study.camera.psf
    psfs = {
        "annular-aperture": Option(
            "Annular aperture", {"camera.psf": {"kind": "annular-aperture"}}
        ),
        "gaussian": Option("Gaussian", {"camera.psf": {"kind": "gaussian", "fwhm": "8 um"}}),
        "none": Option("None (ideal)", {"camera.psf": "none", "camera.blur": []}),
    }
    detectors = {
        "none": Option("None", {"camera.detector": "none"}),
        "noise": Option("Noise", {"camera.detector": _NOISE}),
    }
    limit = camera.build().lower_limit
    detectors = {
        word: Option(one.label, {**one.changes, "camera.lower_limit": limit})
        for word, one in detectors.items()
    }
    orders = {"detector": "Blur on the pixels", "optics": "Blur on the scene"}
    return {
        "scene_image": {k: Option(v) for k, v in SCENE_IMAGES.items() if _is_known(k, scene)},
        "error_image": {name: Option(label) for name, label in ERROR_IMAGES.items()},
        "camera.psf": _first("none" if psf is None else psf.kind, psfs),
        "camera.psf_order": _first(
            camera.psf_order,
            {word: Option(label, {"camera.psf_order": word}) for word, label in orders.items()},
        ),
        "camera.detector": _first(AS_STUDY if camera.detector else "none", detectors),
        "surface": _surfaces(study),
    }


def _first(word: str, options: dict[str, Option]) -> dict[str, Option]:
    """Put the study's own option first, which changes nothing."""
    label = options[word].label if word in options else "As in the study"
    word = word if word in options else AS_STUDY
    return {word: Option(label), **{key: one for key, one in options.items() if key != word}}


def _surfaces(study: Study) -> dict[str, Option]:
    section = study.surface
    uniform = {"uniform": Option("Uniform", {"surface": UniformEmissivity(0.5)})}
    if not isinstance(section, FeaturesSection):
        return _first(section.kind, uniform | {section.kind: Option(section.kind.capitalize())})
    own = changed(section, {"chips": {OWN: "chip-1"}, "maps": {}, "measured": {}})
    kinds = {kind: getattr(section, kind) for kind in ("chips", "maps", "measured")}
    found = {}
    for name in (*surface_names(section), OWN):
        one = {
            kind: {key: held[key] for key in held if key == name} for kind, held in kinds.items()
        }
        surface = own if name == OWN else unchecked(section, **one)
        analysis = changed(study.analysis, {"rake_chip": name, "band_chip": name})
        found[name] = Option(name.capitalize(), {"surface": surface, "analysis": analysis})
    return found | uniform


def _is_known(image: str, scene: Scene) -> bool:
    fields = {"radiance_temperature": "temperature", "emissivity": "temperature"}
    return fields.get(image, "velocity_x" if image == "speed" else image) in scene.fields


def _starts(scene: Scene, duration: float) -> Iterator[float]:
    """Yield the frames at which an exposure can begin that ends within its part of the scene."""
    times, spacing = scene.times, scene.frame_spacing
    for block in scene.blocks:
        end = times[block[-1]] + spacing * (1 + 1e-6)
        yield from (
            rounded(times[i]) for i in block if len(times) == 1 or times[i] + duration <= end
        )


def rounded(time: float) -> float:
    """Return a time to the precision of links."""
    return float(f"{time:.9g}")
