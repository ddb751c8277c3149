"""The controls of the app: rows that name a setting of the study, and the study at their values."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from types import NoneType
from typing import Any, Final, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis import LinePlace
from chipglow.camera.exposure import frame_weights
from chipglow.quantities import changed, setting_at, unchecked, value_at
from chipglow.quantities.units import INSTANT, Quantity, is_bare_number
from chipglow.scene import Raster, Scene
from chipglow.study import Study
from chipglow.study.surface_section import FeaturesSection, surface_names
from chipglow.surface import UniformSurface

Texts: TypeAlias = Mapping[str, str]
"""Values of controls by their paths, as a link writes them; without one the initial value."""

CURSOR: Final = "cursor"
LINES: Final[Mapping[str, str]] = {
    "rake_line": "across the rake face",
    "band_line": "across the shear band",
}
"""The lines, and their names in a study."""

SCENE_IMAGES: Final[Mapping[str, tuple[str, str]]] = {
    "temperature": ("True temperature", "°C"),
    "radiance_temperature": ("Radiance temperature", "°C"),
    "emissivity": ("Emissivity", ""),
    "plastic_strain": ("Plastic strain", ""),
    "plastic_strain_rate": ("Plastic strain rate", "(1/s)"),
    "speed": ("Speed", "(m/s)"),
}
"""Label and unit of each."""

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

_VIEW: Final = ("start", "scene_image", "error_image")
"""Controls of the page itself, which are no settings of a study."""

_FIELDS: Final = {
    "radiance_temperature": "temperature", "emissivity": "temperature", "speed": "velocity_x"
}  # fmt: skip
"""Fields of a scene that its images need, where the names differ."""

_SLACK: Final = 1e-7
"""How far outside the image a position may be in m: links round to this."""


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
    low: float = 0.0
    high: float = 1.0
    step: float = 0.01
    options: Mapping[str, Option] = field(default_factory=dict)
    stops: tuple[float, ...] = ()
    quantity: Quantity | None = None
    optional: bool = False
    whole: bool = False

    @property
    def setting(self) -> str:
        return self.path

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

    def shown(self, value: Any) -> str:
        """Return a value as its field shows it: without its unit, empty for none."""
        if self.options or value is None:
            return value or ""
        return self.text(value).split(" ")[0]

    def value(self, text: str) -> Any:
        """Return the value in SI of a text, with or without its unit."""
        text = text.strip()
        if self.optional and text in ("", "none"):
            return None
        if self.options:
            if text not in self.options:
                raise ValueError(f"{text!r}, expected {', '.join(self.options)}")
            return text
        text = text.replace(",", ".")
        if self.quantity is not None:
            unit = f" {self.quantity.unit}" if is_bare_number(text) else ""
            return self.quantity.parse(text + unit)
        try:
            return int(text) if self.whole else float(text)
        except ValueError:
            kind = "a whole number" if self.whole else "a number"
            raise ValueError(f"{text!r}, expected {kind}") from None


@dataclass(frozen=True)
class PlaceControl(Control):
    """The cursor or the ends of a line, in µm."""

    extent: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    @property
    def setting(self) -> str:
        is_line = self.path in LINES
        return f"analysis.lines.{LINES[self.path]}" if is_line else f"analysis.points.{CURSOR}"

    def text(self, value: Any) -> str:
        points = value if self.path in LINES else (value,)
        return ";".join(f"{1e6 * x:.1f},{1e6 * y:.1f}" for x, y in points)

    def shown(self, value: Any) -> str:
        return self.text(value).replace(",", ", ").replace(";", "; ")

    def value(self, text: str) -> Any:
        """Return positions in m, which are within the image."""
        try:
            pairs = (one.split(",") for one in text.split(";"))
            points = tuple((float(f"{x.strip()}e-6"), float(f"{y.strip()}e-6")) for x, y in pairs)
        except ValueError:
            raise ValueError(f"{text!r}, expected positions such as -35,120 in µm") from None
        count = 2 if self.path in LINES else 1
        if not len(set(points)) == len(points) == count:
            raise ValueError(f"{text!r}, expected {count} different points")
        left, right, bottom, top = self.extent
        for x, y in points:
            if max(left - x, x - right, bottom - y, y - top) > _SLACK:
                raise ValueError(
                    f"{text}, expected x from {1e6 * left:.1f} to {1e6 * right:.1f} µm and y from "
                    f"{1e6 * bottom:.1f} to {1e6 * top:.1f} µm"
                )
        return points if self.path in LINES else points[0]


TABLE: Final = (
    Control("start", "Exposure begins", "Scene", quantity=INSTANT),
    Control("scene_image", "Scene image", "Scene"),
    Control("error_image", "Error image", "Scene"),
    Control("camera.band.0", "Band from", "Camera", 0.8, 8.0, 0.1),
    Control("camera.band.1", "Band to", "Camera", 1.0, 14.0, 0.1),
    Control("camera.pitch", "Pixel pitch", "Camera", 1.0, 30.0, 0.5),
    Control("camera.integration_time", "Exposure", "Camera", 1.0, 50.0, 0.5),
    Control("camera.offset_right", "Pixels right", "Camera", 0.0, 12.0, 0.5),
    Control("camera.offset_down", "Pixels down", "Camera", 0.0, 12.0, 0.5),
    Control("camera.psf", "PSF", "Optics"),
    Control("camera.psf.numerical_aperture", "Numerical aperture", "Optics", 0.1, 0.7),
    Control("camera.psf.fwhm", "PSF width (FWHM)", "Optics", 1.0, 30.0, 0.5),
    Control("camera.psf_order", "Order", "Optics"),
    Control("camera.detector", "Detector", "Detector"),
    Control("camera.detector.terms.0.netd", "Noise (NETD)", "Detector", 0.05, 5.0, 0.05),
    Control("camera.lower_limit", "Lower range limit", "Detector", 0.0, 800.0, 10.0),
    Control("surface", "Emissivity", "Surface"),
    Control(f"surface.chips.{OWN}.body.mean", "Chip, mean", "Surface", 0.05),
    Control(
        f"surface.chips.{OWN}.body.standard_deviation",
        "Chip, std. deviation", "Surface", 0.0, 0.2, 0.005,
    ),
    Control(f"surface.chips.{OWN}.shear_band.mean", "Shear band, mean", "Surface", 0.05),
    Control(
        f"surface.chips.{OWN}.shear_band.standard_deviation",
        "Shear band, std. dev.", "Surface", 0.0, 0.2, 0.005,
    ),
    Control("surface.emissivity", "Uniform emissivity", "Surface", 0.05),
    Control("seed", "Seed", "Surface", 0, 4000, 1),
    Control("camera.reflected", "Reflected temperature", "Surface", 0.0, 300.0, 5.0),
)  # fmt: skip
"""All controls in the order of the page. A control is shown while the study has its setting."""


@dataclass(frozen=True)
class State:
    """The study and the view at some values of the controls; all that a picture depends on."""

    texts: Texts
    study: Study = field(compare=False)
    start: float
    scene_image: str
    error_image: str

    @property
    def cursor(self) -> tuple[float, float]:
        """Position at which numbers are read in m."""
        return self.study.analysis.points[CURSOR]

    def line(self, name: str) -> LinePlace:
        return LinePlace(LINES[name], self.study.analysis.lines[LINES[name]])

    def key(self, *prefixes: str) -> tuple[tuple[str, str], ...]:
        """Return the values of the controls whose paths begin so."""
        return tuple(sorted(one for one in self.texts.items() if one[0].startswith(prefixes)))


@dataclass(frozen=True, eq=False)
class Controls:
    """The controls of a study on a scene or of a measurement, and the states at their values."""

    study: Study
    start: float
    rows: tuple[Control, ...]
    scene: Scene | None = None

    @classmethod
    def of_scene(cls, study: Study, scene: Scene, start: float, duration: float) -> "Controls":
        """Return the controls of a scene; one exposure lasts `duration`."""
        options = _options(study, scene)
        words = (word for row in options.values() for word in row.values())
        studies = [_with(study, word.changes) for word in words]
        side = 1e6 * scene.raster.spacing * min(scene.raster.shape)
        longest = 5e6 * study.camera.integration_time
        ranges: dict[str, dict[str, Any]] = {
            "start": {"stops": tuple(_starts(scene, duration))},
            "camera.pitch": {"high": min(30.0, side)},
            "camera.integration_time": {
                "low": longest / 50, "high": longest, "step": longest / 100
            },
        }  # fmt: skip
        rows: list[Control] = []
        for row in TABLE:
            made = replace(row, options=options.get(row.path, {}), **ranges.get(row.path, {}))
            if not made.options and row.path not in _VIEW:
                having = next((one for one in studies if _has(one, row.path)), None)
                if having is None:
                    continue
                setting = setting_at(having, row.path)
                made = replace(
                    made,
                    quantity=setting.parameter.quantity,
                    optional=NoneType in get_args(setting.kind),
                    whole=setting.kind is int,
                )
            rows.append(made)
        return cls(study, start, (*rows, *_places(scene.raster)), scene)

    @classmethod
    def of_measurement(cls, study: Study, times: NDArray[np.float64], raster: Raster) -> "Controls":
        """Return the controls of a measurement: which of its frames is shown, and the places."""
        row = replace(TABLE[0], label="Frame began", stops=tuple(map(rounded, times)))
        return cls(study, row.stops[0], (row, *_places(raster)))

    @cached_property
    def initial(self) -> State:
        return self.state({})

    @cached_property
    def _by_path(self) -> dict[str, Control]:
        return {row.path: row for row in self.rows}

    def row(self, path: str) -> Control:
        return self._by_path[path]

    def is_shown(self, row: Control, state: State) -> bool:
        return row.path in _VIEW or _has(state.study, row.setting)

    def value(self, row: Control, state: State) -> Any:
        """Return the value of a control: a word, a number in SI or positions; None if hidden."""
        if row.options:
            return _word(row, state.texts)
        if row.path == "camera.lower_limit":
            return state.study.camera.build().lower_limit
        if row.path == "start":
            return state.start
        return value_at(state.study, row.setting) if self.is_shown(row, state) else None

    def changed(self, state: State, texts: Texts) -> State:
        """Return the state with some controls at other values; a ValueError names the control."""
        if unknown := [path for path in texts if path not in self._by_path]:
            known = ", ".join(self._by_path)
            raise ValueError(f"{unknown[0]}: unknown control, expected one of {known}")
        new = dict(state.texts)
        try:
            for path, text in texts.items():
                row = self._by_path[path]
                new[path] = row.text(row.value(text))
                if new[path] == row.text(self.value(row, self.initial)):
                    del new[path]
            made = self.state(new)
            if self.scene is not None:
                _check_exposure(made, self.scene)
        except ValueError as error:
            labels = ", ".join(self._by_path[path].label for path in texts)
            raise ValueError(f"{labels}: {error}") from None
        return made

    def state(self, texts: Texts) -> State:
        """Return the state at given values; the initial ones where none is given."""
        study = self.study
        words = {row.path: _word(row, texts) for row in self.rows if row.options}
        for path, word in words.items():
            study = _with(study, self.row(path).options[word].changes)
        numbers = {
            row.setting: row.value(texts[row.path])
            for row in self.rows
            if row.path in texts and row.path not in _VIEW and not row.options
            and _has(study, row.setting)
        }  # fmt: skip
        return State(
            texts,
            _with(study, numbers),
            self.row("start").value(texts["start"]) if "start" in texts else self.start,
            words.get("scene_image", ""),
            words.get("error_image", ""),
        )


def _word(row: Control, texts: Texts) -> str:
    """Return the word of a control with options, of which the first is the initial one."""
    return texts.get(row.path, next(iter(row.options)))


def _check_exposure(state: State, scene: Scene) -> None:
    camera = state.study.camera.on(scene.raster, state.study.seed)
    camera.pixels(scene.raster)
    duration = camera.frame_duration(scene.raster)
    frame_weights(scene.times, scene.frame_spacing, state.start, duration)


@lru_cache(1000)
def _quantity_text(quantity: Quantity, value: float) -> str:
    """Return the text of a value; most of them are the same at the next state."""
    return quantity.text(value)


def _places(raster: Raster) -> Iterator[PlaceControl]:
    labels = {CURSOR: "Cursor", **{name: f"Line {title}" for name, title in LINES.items()}}
    for path, label in labels.items():
        yield PlaceControl(path, label, "", extent=raster.extent)


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
    limit = {"camera.lower_limit": camera.build().lower_limit}
    psfs = {
        "annular-aperture": Option(
            "Annular aperture", {"camera.psf": {"kind": "annular-aperture"}}
        ),
        "gaussian": Option("Gaussian", {"camera.psf": {"kind": "gaussian", "fwhm": "8 um"}}),
        "none": Option("None (ideal)", {"camera.psf": "none", "camera.blur": []}),
    }
    orders = {
        "detector": Option("Blur on the pixels", {"camera.psf_order": "detector"}),
        "optics": Option("Blur on the scene", {"camera.psf_order": "optics"}),
    }
    detectors = {
        "none": Option("None", {"camera.detector": "none", **limit}),
        "noise": Option("Noise", {"camera.detector": _NOISE, **limit}),
    }
    return {
        "scene_image": {
            name: Option(label)
            for name, (label, _) in SCENE_IMAGES.items()
            if _FIELDS.get(name, name) in scene.fields
        },
        "error_image": {name: Option(label) for name, label in ERROR_IMAGES.items()},
        "camera.psf": _first("none" if psf is None else psf.kind, psfs),
        "camera.psf_order": _first(camera.psf_order, orders),
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
    uniform = {"uniform": Option("Uniform", {"surface": UniformSurface(0.5)})}
    if not isinstance(section, FeaturesSection):
        return _first(section.kind, uniform | {section.kind: Option(section.kind.capitalize())})
    kinds = {kind: getattr(section, kind) for kind in ("chips", "maps", "measured")}
    surfaces = {
        name: unchecked(
            section,
            **{
                kind: {key: one for key, one in of_kind.items() if key == name}
                for kind, of_kind in kinds.items()
            },
        )
        for name in surface_names(section)
    }
    surfaces[OWN] = changed(section, {"chips": {OWN: "chip-1"}, "maps": {}, "measured": {}})
    return {
        name: Option(name.capitalize(), {"surface": surface, "analysis": _reading(study, name)})
        for name, surface in surfaces.items()
    } | uniform


def _reading(study: Study, chip: str) -> object:
    return changed(study.analysis, {"rake_chip": chip, "band_chip": chip})


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
