"""The controls of the app: a table of paths into the study, and the study at their values."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from math import floor, inf
from typing import Annotated, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis import LinePlace
from chipglow.camera import MeasuredPSFFile, PSFChoice
from chipglow.camera.exposure import frame_weights
from chipglow.correction.known import known_parts
from chipglow.io import load_tool
from chipglow.laboratory.emissivity import StoredEmissivities
from chipglow.laboratory.emissivity.places import FOUND
from chipglow.quantities import Parameter, changed, setting_at, unchecked, value_at
from chipglow.quantities.units import (
    INSTANT,
    LENGTH,
    TEMPERATURE_DIFFERENCE,
    Quantity,
    is_bare_number,
)
from chipglow.scene import Raster, Scene
from chipglow.study import Study
from chipglow.study.measured_corrections import cameras_with_aperture, psf_choice
from chipglow.study.surface_section import FeaturesSection, surface_names
from chipglow.surface import UniformSurface

Texts: TypeAlias = Mapping[str, str]
"""Values of controls by their paths, as a link writes them; without one the initial value."""

CURSOR: Final = "cursor"
EXPOSURE: Final = "camera.integration_time"
LINES: Final[Mapping[str, str]] = {
    "rake_line": "across the rake face",
    "band_line": "across the shear band",
}
"""The lines, and their names in a study."""

SCENE_IMAGES: Final[Mapping[str, tuple[str, str, str]]] = {
    "temperature": ("True temperature", "°C", "temperature"),
    "radiance_temperature": ("Radiance temperature", "°C", "temperature"),
    "emissivity": ("Emissivity", "", "temperature"),
    "plastic_strain": ("Plastic strain", "", "plastic_strain"),
    "plastic_strain_rate": ("Plastic strain rate", "(1/s)", "plastic_strain_rate"),
    "speed": ("Speed", "(m/s)", "velocity_x"),
}
"""Label, unit and the scene's field that each needs."""

ERROR_IMAGES: Final[Mapping[str, str]] = {
    "total": "Error",
    "emissivity": "Error by emissivity",
    "motion": "Error by motion",
    "footprint": "Error by footprint",
    "psf": "Error by PSF",
    "texture": "Error by texture",
}

ERRORS, CORRECTION, CAMERAS = "error", "correction", "cameras"
SHOWN_IMAGES: Final[Mapping[str, str]] = {
    ERRORS: "Scene and error",
    CORRECTION: "Correction",
    CAMERAS: "Two cameras",
}
"""Sets of images: scene, measured and error; measured and those of the correction; or the scene
and the images of two cameras."""

SECOND: Final = "second:"
"""Beginning of the names of values that are the second camera's."""

EDITED: Final = {"first": "First camera", "second": "Second camera"}
"""Cameras that the controls change."""

CORRECTION_IMAGES: Final[Mapping[str, str]] = {
    "corrected": "Corrected temperature",
    "half_width": "Half-width (95 %)",
    "true": "True temperature",
    "error": "Corrected − true",
}
"""Titles of the images of a correction, the last two of a scene alone."""

WHOLE: Final = "whole"
PARTS: Final[Mapping[str, str]] = {
    "48": "48 × 48 pixels",
    "96": "96 × 96 pixels",
    "192": "192 × 192 pixels",
    WHOLE: "Whole frame",
}
"""Parts of a measured frame that are corrected, around the cursor."""

REFLECTED: Final = "293 K"
"""Reflected temperature of a measurement: the default of `chipglow.correct`."""

CORRECTING: Final = (
    "emissivity", "elsewhere", "camera.psf", "camera.reflected", "corrected_part", "psf_", "tool",
    "outline_uncertainty", "reflected_uncertainty",
)  # fmt: skip
"""Beginnings of the paths of controls on which the correction of a measurement depends."""

_ONLY_WITH: Final[Mapping[str, str]] = {
    "edited": CAMERAS,
    "set_emissivity": CAMERAS,
    "scene_image": ERRORS,
    "error_image": ERRORS,
    "analysis.reference": ERRORS,
    "emissivity_uncertainty": CORRECTION,
}
"""Controls that have an effect on one kind of images alone."""

REFERENCES: Final[Mapping[str, str]] = {
    "maximum": "Radiance maximum",
    "mean": "Radiance mean",
    "centre": "Radiance centre",
    "true-maximum": "True maximum",
    "true-mean": "True mean",
    "true-centre": "True centre",
}
"""Labels of the references: radiance or true temperature over pixel and exposure."""

PSF_FILE: Final = "file"
"""Choice of a point spread function that a file states."""

SESSION_PSF: Final = "session"
"""Choice of the point spread function that the session states."""

OWN: Final = "own numbers"
AS_STUDY: Final = "study"
_NOISE: Final = {
    "response": {"kind": "range", "hottest": "2500 degC"},
    "full_well": 1e9,
    "bits": 28,
    "terms": [{"kind": "netd", "netd": "0.1 K", "temperature": "300 degC"}],
}
"""A detector with this noise and steps too fine to matter."""

_EARLY: Final = 1e-6
"""Rounding of times relative to the spacing of frames."""

_SLACK: Final = 1e-7
"""Tolerance of a position outside the image in m: links round to this."""


@dataclass(frozen=True)
class ShownStudy(Study):
    """A study of an open scene, and what the page shows of it."""

    start: Annotated[float, Parameter("Start of the exposure.", INSTANT)] = 0.0
    scene_image: Annotated[str, Parameter("Image of the scene.")] = "temperature"
    error_image: Annotated[str, Parameter("Image of the error.")] = "total"
    images: Annotated[str, Parameter("Kind of images.")] = ERRORS
    emissivity: Annotated[
        float | None,
        Parameter("Emissivity of the measured object; none: not known.", over=0.0, most=1.0),
    ] = None
    emissivity_file: Annotated[
        str | None, Parameter("Emissivities of places by name, output of chipglow emissivity.")
    ] = None
    elsewhere: Annotated[
        str | None, Parameter("Name of the emissivity outside the regions in that file.")
    ] = None
    edited: Annotated[str, Parameter("Camera that the controls change.")] = "first"
    set_emissivity: Annotated[
        float,
        Parameter(
            "Emissivity set in the camera, by which it computes the temperature that it shows.",
            over=0.0,
            most=1.0,
        ),
    ] = 1.0
    corrected_part: Annotated[str, Parameter("Part of a frame that is corrected.")] = "48"
    psf_source: Annotated[str, Parameter("Whether a file states the PSF, or the page.")] = "page"
    psf_file: Annotated[str | None, Parameter("Point spread function, output of chipglow psf.")] = (
        None
    )
    psf_uncertainty: Annotated[
        float, Parameter("Relative standard uncertainty of the width of the PSF.", least=0.0)
    ] = 0.0
    tool: Annotated[
        str | None,
        Parameter("Tool: a YAML file, or 'found' to detect it; none: as the measurement states."),
    ] = None
    tool_emissivity: Annotated[
        float | None,
        Parameter("Emissivity of the tool; none: that of the image.", over=0.0, most=1.0),
    ] = None
    tool_emissivity_uncertainty: Annotated[
        float, Parameter("Standard uncertainty of the tool's emissivity.", least=0.0, under=1.0)
    ] = 0.01
    outline_uncertainty: Annotated[
        float | None,
        Parameter(
            "Standard uncertainty of the position of outlines; none: that of a found tool.",
            LENGTH,
            least=0.0,
        ),
    ] = None
    reflected_uncertainty: Annotated[
        float,
        Parameter(
            "Standard uncertainty of the reflected temperature.", TEMPERATURE_DIFFERENCE, least=0.0
        ),
    ] = 0.0
    emissivity_uncertainty: Annotated[
        float, Parameter("Standard uncertainty of the mean emissivity.", least=0.0, under=1.0)
    ] = 0.01

    @property
    def takes_elsewhere(self) -> bool:
        """Whether a name in the emissivity file holds outside the regions: no number is stated."""
        return self.emissivity_file is not None and self.emissivity is None

    @property
    def named_elsewhere(self) -> str | None:
        """The name in the emissivity file that holds outside the regions, if any."""
        return self.elsewhere if self.takes_elsewhere else None

    def _check_camera(self) -> None:
        """Its cut need not suit the camera: the scene exists."""


@dataclass(frozen=True)
class Option:
    """A choice of a control: its label, and the settings that it changes."""

    label: str
    changes: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Control:
    """A row of the table. Ends, step and stops of the slider are in the unit of the setting."""

    path: str
    label: str
    group: str = ""
    low: float = 0.0
    high: float = 1.0
    step: float = 0.01
    options: Mapping[str, Option] = field(default_factory=dict)
    stops: tuple[float, ...] = ()
    points: int = 0
    quantity: Quantity | None = None
    is_text: bool = False
    """Whether it is the name of a file, or a word."""
    hint: str = "none"
    """Shown in an empty field."""

    @property
    def setting(self) -> str:
        """Path in the study."""
        if not self.points:
            return self.path
        name = LINES.get(self.path)
        return f"analysis.lines.{name}" if name else f"analysis.points.{self.path}"

    @property
    def unit(self) -> str:
        """Unit as a page shows it; empty for none."""
        unit = self.quantity.unit if self.quantity else ""
        return {"um": "µm", "us": "µs", "degC": "°C"}.get(unit, unit)

    def text(self, value: Any) -> str:
        """Return a value of the study as links write it."""
        if self.points:
            pairs = value if self.path in LINES else (value,)
            return ";".join(f"{1e6 * x:.1f},{1e6 * y:.1f}" for x, y in pairs)
        if value is None:
            return "none"
        if self.quantity is not None and not isinstance(value, str):
            return _quantity_text(self.quantity, value)
        return value if isinstance(value, str) else f"{value:.10g}"

    def shown(self, text: str) -> str:
        """Return a text as its field shows it: without its unit, empty for none."""
        if self.points:
            return text.replace(",", ", ").replace(";", "; ")
        if self.options:
            return text
        if text == "none":
            return ""
        return text if self.is_text else text.split(" ")[0]

    def parse(self, text: str) -> object:
        """Return what the study takes for a text, with or without its unit."""
        text = text.strip()
        if self.points:
            return self._positions(text)
        if self.is_text:
            return text or None
        text = text.replace(",", ".").replace("−", "-") or "none"
        if not is_bare_number(text):
            return text
        if self.quantity is not None:
            return f"{text} {self.quantity.unit}"
        return int(text) if text.isdecimal() else float(text)

    def _positions(self, text: str) -> object:
        try:
            pairs = [[float(number) for number in pair.split(",")] for pair in text.split(";")]
            x, y = zip(*pairs, strict=True)
        except ValueError:
            x = y = ()
        if len(x) != self.points:
            raise ValueError(f"{text!r}, expected {self.points} x,y in µm such as -35,120")
        places = tuple((f"{x[i]:.1f} um", f"{y[i]:.1f} um") for i in range(len(x)))
        return places if self.path in LINES else places[0]


TABLE: Final = (
    Control("start", "Exposure begins", "Scene"),
    Control("images", "Images", "Scene"),
    Control("scene_image", "Scene image", "Scene"),
    Control("error_image", "Error image", "Scene"),
    Control("analysis.reference", "Error against", "Scene"),
    Control("edited", "Controls of", "Camera"),
    Control("set_emissivity", "Emissivity set", "Camera", 0.05),
    Control("camera.band.0", "Band from", "Camera", 0.8, 8.0, 0.1),
    Control("camera.band.1", "Band to", "Camera", 1.0, 14.0, 0.1),
    Control("camera.pitch", "Pixel pitch", "Camera", 1.0, 30.0, 0.5),
    Control(EXPOSURE, "Exposure", "Camera", 1.0, 50.0, 0.5),
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
    Control("emissivity_uncertainty", "Uncertainty (k = 1)", "Surface", 0.0, 0.1, 0.005),
    Control("seed", "Seed", "Surface", 0, 4000, 1),
    Control("camera.reflected", "Reflected temperature", "Surface", 0.0, 300.0, 5.0),
)  # fmt: skip
"""The controls of a column in their order. One is shown while the study has its setting."""

_CORRECTED: Final = (
    Control("emissivity", "Emissivity", "Correction", 0.05),
    Control("emissivity_uncertainty", "Uncertainty (k = 1)", "Correction", 0.0, 0.1, 0.005),
    Control(
        "emissivity_file",
        "Emissivity file",
        "Correction",
        is_text=True,
        hint="file of chipglow emissivity",
    ),
    Control("elsewhere", "Elsewhere", "Correction", is_text=True, hint="none, or a name in it"),
    Control("tool", "Tool", "Correction", is_text=True, hint="none, found, or a file"),
    Control("tool_emissivity", "Tool, emissivity", "Correction", 0.05),
    Control("tool_emissivity_uncertainty", "Tool, its u (k = 1)", "Correction", 0.0, 0.1, 0.005),
    Control("outline_uncertainty", "Outlines, u (k = 1)", "Correction", 0.0, 10.0, 0.1),
    Control("camera.reflected", "Reflected temperature", "Correction", 0.0, 300.0, 5.0),
    Control("reflected_uncertainty", "Reflected, u (k = 1)", "Correction", 0.0, 20.0, 0.5),
    Control("camera.psf", "PSF", "Correction"),
    Control("psf_file", "PSF file", "Correction", is_text=True, hint="psf.nc of chipglow psf"),
    Control("camera.psf.numerical_aperture", "Numerical aperture", "Correction", 0.1, 0.7),
    Control("camera.psf.fwhm", "PSF width (FWHM)", "Correction", 1.0, 100.0, 0.5),
    Control("psf_uncertainty", "PSF width, relative u", "Correction", 0.0, 0.2, 0.005),
    Control("corrected_part", "Part", "Correction"),
)
"""The controls of the correction of a measurement."""

PLACES: Final = (
    Control(CURSOR, "Cursor", points=1),
    *(Control(name, f"Line {title}", points=2) for name, title in LINES.items()),
)
"""The controls of positions on the images."""


@dataclass(frozen=True)
class State:
    """The study at some values of the controls; all that a picture depends on."""

    texts: Texts
    study: ShownStudy = field(compare=False)
    second: "State | None" = field(default=None, compare=False)
    """The same state with the second camera, if two are shown."""

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

    study: ShownStudy
    rows: Mapping[str, Control]
    raster: Raster
    scene: Scene | None = None
    has_tool: bool = False
    """Whether a measurement states its tool."""
    _emissivities: dict[str, StoredEmissivities] = field(
        init=False, default_factory=dict, repr=False
    )
    """Files that were named."""

    @classmethod
    def of_scene(cls, study: ShownStudy, scene: Scene, duration: float) -> "Controls":
        """Return the controls of a scene; one exposure lasts `duration`."""
        options = _options(study, scene)
        side = 1e6 * scene.raster.spacing * min(scene.raster.shape)
        exposure = 1e6 * study.camera.integration_time
        ranges: dict[str, dict[str, Any]] = {
            "start": {"stops": tuple(_starts(scene, duration))},
            "camera.pitch": {"high": min(30.0, side)},
            EXPOSURE: {"low": exposure / 10, "high": 5 * exposure, "step": exposure / 20},
        }
        rows = _declared(TABLE, study, options, ranges)
        return cls(study, rows | {row.path: row for row in PLACES}, scene.raster, scene)

    @classmethod
    def of_frames(cls, study: Study, times: NDArray[np.float64], raster: Raster) -> "Controls":
        """Return the controls of frames: which of them is shown, and the places."""
        stops = tuple(rounded(1e6 * one) for one in times)
        row = replace(TABLE[0], label="Frame began", group="Frame", stops=stops, quantity=INSTANT)
        rows = {row.path: row for row in (row, *PLACES)}
        return cls(shown_study(study, images=CORRECTION, start=rounded(times[0])), rows, raster)

    @classmethod
    def of_measurement(
        cls, study: Study, times: NDArray[np.float64], raster: Raster, has_tool: bool
    ) -> "Controls":
        """Return the controls of a measurement: those of its frames and of their correction."""
        none = {"camera.psf": "none", "camera.blur": ()}
        study = changed(study, {**none, "camera.reflected": REFLECTED})
        frames = cls.of_frames(study, times, raster)
        options = {
            "camera.psf": {
                **_first("none", _psfs("Not stated")),
                PSF_FILE: Option("From a file", {**none, "psf_source": PSF_FILE}),
                **_psfs_of_cameras(raster.spacing),
            },
            "corrected_part": {
                part: Option(label, {"corrected_part": part}) for part, label in PARTS.items()
            },
        }
        rows = _declared(_CORRECTED, frames.study, options, {})
        return replace(frames, rows={**frames.rows, **rows}, has_tool=has_tool)

    def with_psf(self, psf: PSFChoice) -> "Controls":
        """Return the controls of a measurement with a further choice of the PSF, of a session."""
        row = self.rows["camera.psf"]
        choice = Option("As in the session", {"camera.psf": psf, "camera.blur": ()})
        row = replace(row, options={**row.options, SESSION_PSF: choice})
        return replace(self, rows={**self.rows, row.path: row})

    @cached_property
    def initial(self) -> State:
        return self.state({})

    def values(self, state: State) -> dict[str, str]:
        """Return the texts of all controls that the study of a state has."""
        return {
            path: _word(row, state.texts) if row.options else
            row.text(value_at(state.study, row.setting))
            for path, row in self.rows.items()
            if row.options or _has(state.study, row.setting)
        }  # fmt: skip

    def shown(self, state: State) -> dict[str, str]:
        """Return the texts of the controls that have an effect, as their fields show them."""
        values = self.values(state)
        if _edits_second(state) and state.second is not None:
            values = {path: text for path, text in values.items() if not _of_camera(path)}
            of_second = self.values(state.second).items()
            values |= {path: text for path, text in of_second if _of_camera(path)}
        return {
            path: self.rows[path].shown(text)
            for path, text in values.items()
            if _ONLY_WITH.get(path, state.study.images) == state.study.images
            and self._has_effect(path, state.study)
        }

    def _has_effect(self, path: str, study: ShownStudy) -> bool:
        """Return whether a control of a correction has an effect, by the other ones."""
        if path.startswith("tool_"):
            return self.has_tool or study.tool is not None
        if path == "elsewhere":
            return study.takes_elsewhere
        return path != "psf_file" or study.psf_source == PSF_FILE

    def ranges(self, state: State) -> dict[str, list[float]]:
        """Return what the scene allows at a state: the stops of the start, the exposure's ends.

        All are in µs; a start or an exposure that the scene does not contain is not among them.
        """
        if self.scene is None:
            return {}
        camera = state.study.camera
        duration = camera.on(self.raster, state.study.seed).frame_duration(self.raster)
        row = self.rows[EXPOSURE]
        room = 1e6 * (_room(self.scene, state.study.start) - duration + camera.integration_time)
        longest = row.high if room >= row.high else row.step * floor(room / row.step)
        return {
            "start": list(_starts(self.scene, duration)) or [rounded(1e6 * state.study.start)],
            EXPOSURE: [row.low, max(longest, row.low)],
        }

    def state_with(self, state: State, texts: Texts) -> State:
        """Return the state with some controls at other values; a ValueError names the control."""
        if _edits_second(state):
            texts = {SECOND + path if _of_camera(path) else path: texts[path] for path in texts}
        names = {path: path.removeprefix(SECOND) for path in texts}
        if unknown := [path for path in names.values() if path not in self.rows]:
            known = ", ".join(self.rows)
            raise ValueError(f"{unknown[0]}: unknown control, expected one of {known}")
        try:
            made = self.state({**state.texts, **texts})
            self._check(made)
            self._check_files(made.study, texts)
        except ValueError as error:
            message = str(error)
            for path in names.values():
                whole, _, number = (setting := self.rows[path].setting).rpartition(".")
                message = message.removeprefix(f"{whole if number.isdigit() else setting}: ")
            message = message.removeprefix("exposure: ").removeprefix("camera: ")
            labels = ", ".join(self.rows[path].label for path in names.values())
            raise ValueError(f"{labels}: {message}") from None
        initial = self.values(self.initial)
        written = {**made.texts, **self.values(made)}
        if made.second is not None:
            second = self.values(made.second)
            written |= {SECOND + path: text for path, text in second.items() if _of_camera(path)}
        return replace(
            made,
            texts={
                path: written[path]
                for path in made.texts
                if written[path] != initial.get(path.removeprefix(SECOND))
            },
        )

    def state(self, texts: Texts) -> State:
        """Return the state at given values; the initial ones where none is given."""
        study = self._study({path: text for path, text in texts.items() if SECOND not in path})
        if study.images != CAMERAS:
            return State(texts, study)
        common = {path: text for path, text in texts.items() if not _of_camera(path)}
        own = {path.removeprefix(SECOND): text for path, text in common.items() if SECOND in path}
        of_second = {path: text for path, text in common.items() if SECOND not in path} | own
        return State(texts, study, State(of_second, self._study(of_second)))

    def _study(self, texts: Texts) -> ShownStudy:
        study, words = self.study, dict[str, object]()
        for row in self.rows.values():
            if row.options:
                word = _word(row, texts)
                if word not in row.options:
                    raise ValueError(f"{word!r}, expected {', '.join(row.options)}")
                words |= row.options[word].changes
        study = changed(study, words)
        numbers = {
            row.setting: row.parse(texts[path])
            for path, row in self.rows.items()
            if path in texts and not row.options and _has(study, row.setting)
        }
        return changed(study, numbers)

    def _check(self, state: State) -> None:
        """Raise a ValueError unless the camera can see the scene, and places are in the image."""
        left, right, bottom, top = self.raster.extent
        lines = (state.line(name).corners for name in LINES)
        x, y = np.array([state.cursor, *(corner for line in lines for corner in line)]).T
        if max(left - x.min(), x.max() - right, bottom - y.min(), y.max() - top) > _SLACK:
            raise ValueError(
                f"outside the image, expected x from {1e6 * left:.1f} to {1e6 * right:.1f} µm "
                f"and y from {1e6 * bottom:.1f} to {1e6 * top:.1f} µm"
            )
        if self.scene is not None:
            camera = state.study.camera.on(self.raster, state.study.seed)
            duration = camera.frame_duration(self.raster)
            frame_weights(self.scene.times, self.scene.frame_spacing, state.study.start, duration)
        if state.second is not None:
            self._check(state.second)

    def _check_files(self, study: ShownStudy, texts: Texts) -> None:
        """Raise a ValueError if a file that was named now is not what it must be."""
        try:
            if "psf_file" in texts and study.psf_file is not None:
                MeasuredPSFFile(study.psf_file)
            if "emissivity_file" in texts and study.emissivity_file is not None:
                file = study.emissivity_file
                self._emissivities[file] = StoredEmissivities.read(file)
            if (stored := self.emissivities(study)) is not None:
                known_parts(stored.lines, elsewhere=study.named_elsewhere)
            if "tool" in texts and study.tool not in (None, FOUND):
                load_tool(str(study.tool))
        except OSError as error:
            is_of_system = error.filename is not None
            message = f"{error.filename}: {error.strerror}" if is_of_system else str(error)
            raise ValueError(message) from None

    def emissivities(self, study: ShownStudy) -> StoredEmissivities | None:
        """Return the emissivities of the file that a state names, as they were at that time."""
        return None if study.emissivity_file is None else self._emissivities[study.emissivity_file]


def shown_study(study: Study, **shown: Any) -> ShownStudy:
    """Return a study with settings of the page, such as the start of the exposure."""
    return ShownStudy(**{name: getattr(study, name) for name in study.given}, **shown)


def _of_camera(path: str) -> bool:
    """Return whether a control is one of a camera: not of its surroundings."""
    return path == "set_emissivity" or (path.startswith("camera.") and path != "camera.reflected")


def _edits_second(state: State) -> bool:
    return state.study.images == CAMERAS and state.study.edited == "second"


def _word(row: Control, texts: Texts) -> str:
    """Return the word of a control with options, of which the first is the initial one."""
    return texts.get(row.path, next(iter(row.options)))


@lru_cache(1000)
def _quantity_text(quantity: Quantity, value: float) -> str:
    """Return the text of a value; most of them are the same at the next state."""
    return quantity.text(value)


def _has(study: Study, path: str) -> bool:
    with suppress(LookupError):
        value_at(study, path)
        return True
    return False


def _declared(
    table: Iterable[Control],
    study: Study,
    options: Mapping[str, Mapping[str, Option]],
    ranges: Mapping[str, dict[str, Any]],
) -> dict[str, Control]:
    """Return the controls whose setting the study has, or has with one of the options."""
    words = (word for row in options.values() for word in row.values())
    studies = [study, *(changed(study, word.changes) for word in words)]
    rows = {}
    for row in table:
        first = next((one for one in studies if _has(one, row.path)), None)
        if first is not None:
            own, of_row = ranges.get(row.path, {}), options.get(row.path, {})
            quantity = setting_at(first, row.path).parameter.quantity
            rows[row.path] = replace(row, quantity=quantity, options=of_row, **own)
    return rows


def _psfs(none: str) -> dict[str, Option]:
    return {
        "annular-aperture": Option(
            "Annular aperture", {"camera.psf": {"kind": "annular-aperture"}}
        ),
        "gaussian": Option("Gaussian", {"camera.psf": {"kind": "gaussian", "fwhm": "8 um"}}),
        "none": Option(none, {"camera.psf": "none", "camera.blur": ()}),
    }


def _psfs_of_cameras(pitch: float) -> dict[str, Option]:
    """Return the point spread functions of the cameras that a study knows by name."""
    options = {}
    for name in cameras_with_aperture():
        with suppress(ValueError):  # no lens sees pixels that small
            changes = {"camera.psf": psf_choice(name, pitch), "camera.blur": ()}
            options[name] = Option(name, changes)
    return options


def _options(study: Study, scene: Scene) -> dict[str, dict[str, Option]]:
    """Return the words of the controls that have some, the study's own one first."""
    camera, psf = study.camera, study.camera.psf
    limit = {"camera.lower_limit": camera.build().lower_limit}
    detectors = {
        "none": Option("None", {"camera.detector": "none", **limit}),
        "noise": Option("Noise", {"camera.detector": _NOISE, **limit}),
    }
    scene_images = {
        name: label for name, (label, _, needed) in SCENE_IMAGES.items() if needed in scene.fields
    }
    words = {
        "scene_image": scene_images,
        "error_image": ERROR_IMAGES,
        "images": SHOWN_IMAGES,
        "edited": EDITED,
        "analysis.reference": REFERENCES,
        "camera.psf_order": {"detector": "Blur on the pixels", "optics": "Blur on the scene"},
    }
    options = {
        "camera.psf": _first("none" if psf is None else psf.kind, _psfs("None (ideal)")),
        "camera.detector": _first(AS_STUDY if camera.detector else "none", detectors),
        "surface": _surfaces(study),
    }
    for path, labels in words.items():
        every = {word: Option(label, {path: word}) for word, label in labels.items()}
        options[path] = _first(value_at(study, path), every)
    return options


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
    surfaces = {}
    for name in surface_names(section):
        alone = {kind: {name: one[name]} if name in one else {} for kind, one in kinds.items()}
        surfaces[name] = unchecked(section, **alone)
    own = {"chips": {OWN: "chip-1"}, "maps": {}, "measured": {}}
    surfaces.setdefault(OWN, changed(section, own))  # a study that was saved here may have it
    options = {}
    for name, surface in surfaces.items():
        changes = {"surface": surface, "analysis.rake_chip": name, "analysis.band_chip": name}
        options[name] = Option(name.capitalize(), changes)
    return options | uniform


def _room(scene: Scene, start: float) -> float:
    """Return the time in s from a start to the end of its part of the scene."""
    times = scene.times
    if len(times) == 1:
        return inf
    after = times[[block[-1] for block in scene.blocks]] + scene.frame_spacing - start
    return float(min(after[after > 0], default=0.0) + _EARLY * scene.frame_spacing)


def _starts(scene: Scene, duration: float) -> Iterator[float]:
    """Yield the times in µs at which an exposure can begin that ends within its part."""
    times, spacing = scene.times, scene.frame_spacing
    for block in scene.blocks:
        end = times[block[-1]] + spacing * (1 + _EARLY)
        yield from (
            rounded(1e6 * times[i]) for i in block if len(times) == 1 or times[i] + duration <= end
        )


def rounded(time: float) -> float:
    """Return a time to the precision of links."""
    return float(f"{time:.9g}")
