"""The command ``chipglow show`` for scenes and measurements."""

import json
from collections.abc import Iterator, Mapping
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.camera import Flag, Measurement
from chipglow.cli.screen import current, figure, finish
from chipglow.drawing.scales import shown_frame
from chipglow.io import StoredScene, checked_kind, open_scene, read_measurement
from chipglow.io.measurement_file import holds
from chipglow.laboratory.recordings import flag_fractions
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene import ENERGY_UNITS, Raster, Tool, ToolGeometry
from chipglow.text import Notes

if TYPE_CHECKING:
    from chipglow.scene import SceneSummary

_LONGEST_TEXT: Final = 800
"""Characters of a text that are shown."""

_LONGEST_LIST: Final = 8
"""Items of a list that are shown."""

_FLAG_NAMES: Final = {
    Flag.UNDER_RANGE: "below the lower range limit or the calibration",
    Flag.SATURATED: "saturated or above the calibration",
    Flag.DEAD: "dead",
    Flag.REPLACED: "replaced by neighbours",
}
_PRINTED_APART: Final = (
    "assumed", "warnings", "band_lower", "band_upper", "pitch", "tool_", "integration_time",
    "lower_limit", "netd",
)  # fmt: skip
"""Beginnings of the names of a measurement's attributes that are not listed as such."""

_Rows: TypeAlias = Iterator[tuple[str, str]]


def show(path: Path, at: float | None, plot: Path | None) -> None:
    """Print the contents of a scene or a measurement and optionally draw it."""
    from chipglow.scene import draw_scene, scene_summary

    kind = checked_kind(path, "a scene or measurement", "scene", "measurement", "arrays")
    if kind == "measurement":
        _show_measurement(path, at, plot)
        return
    if path.is_file() and not holds(path, ()):
        raise ValueError(
            f"{path}: not a NetCDF-4 file, or truncated; expected a scene or measurement"
        )
    if path.is_file() and kind != "scene" and not holds(path, ("temperature",)):
        raise ValueError(
            f"{path}: contains neither temperature nor radiance; expected a scene or measurement"
        )
    scene = open_scene(path)
    time = None if at is None else scene.times[shown_frame(scene.times, at, "scene", "--at: ")]
    summary = scene_summary(scene, time)
    screen = current()
    screen.facts("scene", _scene_facts(scene, path))
    screen.heading(f"\nAt {microseconds(scene.times[summary.index])}:")
    screen.facts("state", _state(summary))
    screen.heading()
    everywhere = f"in {len(summary.sampled)} frames"
    columns = {everywhere if name == "overall" else name: name for name in summary.fields}
    screen.table("fields", summary.fields, columns, "Over the material", unbroken=("field",))
    screen.values(_raster_values(scene.raster, scene.times))
    screen.values({"at_us": 1e6 * scene.times[summary.index]})
    _show_attributes(scene.data.attrs, ("tool_",))
    finish(Notes(), (plot, figure(draw_scene, scene, time)))
    scene.data.close()


def _show_measurement(path: Path, at: float | None, plot: Path | None) -> None:
    from chipglow.laboratory.recordings.figure import draw_measurement

    measurement = read_measurement(path)
    times = measurement.times
    time = None if at is None else times[shown_frame(times, at, option="--at: ")]
    say_measurement(measurement, time)
    finish(measurement.notes, (plot, figure(draw_measurement, measurement, time)))


def say_measurement(measurement: Measurement, time: float | None = None) -> None:
    """Print the contents of a measurement."""
    screen = current()
    screen.facts("measurement", _measurement_facts(measurement, time))
    screen.values(_raster_values(measurement.raster, measurement.times))
    _show_attributes(measurement.data.attrs, _PRINTED_APART)


def _scene_facts(scene: StoredScene, path: Path) -> _Rows:
    raster, times, data = scene.raster, scene.times, scene.data
    yield from _where_and_when("samples", raster, times)
    if len(scene.blocks) > 1:
        spans = (_span(times[one.start : one.stop]) for one in scene.blocks)
        yield "parts without gap", ", ".join(spans)
    yield "tool", _tool_text(scene.tool) if scene.tool else "not given"
    yield "material coordinates", "yes" if scene.has_material_coordinates else "no"
    if "force_time" in data:
        energies = ", with energies" if set(ENERGY_UNITS) <= set(data) else ""
        yield "forces", f"{data.sizes['force_time']} records{energies}"
    size = path.stat().st_size
    each = size / (len(times) * raster.rows * raster.columns)
    yield "file", f"{size / 1e6:,.1f} MB, {each:.2g} bytes a sample ({scene.compression})"


def _where_and_when(name: str, raster: Raster, times: NDArray[np.float64]) -> _Rows:
    left, right, bottom, top = (f"{round(1e6 * edge, 6):.6g} µm" for edge in raster.extent)
    yield name, f"{raster.columns} x {raster.rows} of {1e6 * raster.spacing:.6g} µm"
    yield "x", f"{left} to {right}"
    yield "y", f"{bottom} to {top}"
    yield "frames", f"{len(times)}, {_span(times)}"
    if len(times) > 1:
        least, mean, largest = (float(f(np.diff(times))) for f in (np.min, np.mean, np.max))
        is_even = largest - least < 1e-3 * mean
        uneven = f"{microseconds(least)} to {microseconds(largest)}"
        yield "interval", microseconds(mean) if is_even else uneven


def _span(times: NDArray[np.float64]) -> str:
    return f"{microseconds(times[0])} to {microseconds(times[-1])}"


def _tool_text(tool: Tool) -> str:
    text = f"rake {degrees(tool.rake_angle):.4g}°, clearance {degrees(tool.clearance_angle):.4g}°"
    if not isinstance(tool, ToolGeometry):
        return f"{text}, outline of {len(tool.corners)} points"
    parts = [text, f"edge radius {1e6 * tool.edge_radius:.4g} µm"]
    parts += ["chamfer"] * (tool.chamfer is not None) + ["hone"] * (tool.hone is not None)
    return ", ".join(parts)


def _state(summary: "SceneSummary") -> _Rows:
    fractions = (
        f"{kind.name.lower()} {100 * fraction:.3g} %"
        for kind, fraction in summary.fractions.items()
    )
    yield "samples that show", ", ".join(fractions)
    quality = summary.quality
    if quality is not None:
        yield "filled", f"{100 * quality.filled:.3g} % of the samples with material"
        yield (
            "colour distance",
            f"median {quality.median:.3g}, 95 % within {quality.percentile_95:.3g}",
        )


def _raster_values(raster: Raster, times: NDArray[np.float64]) -> dict[str, Any]:
    return {
        "rows": raster.rows,
        "columns": raster.columns,
        "spacing_um": 1e6 * raster.spacing,
        "extent_um": [1e6 * edge for edge in raster.extent],
        "times_us": 1e6 * times,
    }


def _show_attributes(attributes: Mapping[Any, Any], omitted: tuple[str, ...]) -> None:
    """Print the other attributes of a file, if any, below a heading."""
    others = {
        str(name): value for name, value in attributes.items() if not str(name).startswith(omitted)
    }
    if others:
        screen = current()
        screen.heading("\nAttributes:")
        texts = {name: _attribute_text(value) for name, value in others.items()}
        screen.facts("attributes", texts.items())
        screen.values({"attributes": others})


def _attribute_text(value: Any) -> str:
    """Return an attribute as text of limited length; JSON is flattened by its keys."""
    text = str(value)
    try:
        parsed = json.loads(text)
    except (ValueError, RecursionError):
        parsed = None
    if isinstance(parsed, dict):
        leaves = pd.json_normalize(parsed).to_dict("records")[0]
        long = {
            name: isinstance(one, list) and len(one) > _LONGEST_LIST for name, one in leaves.items()
        }
        text = ", ".join(
            f"{name} [{len(leaf)} values]" if long[name] else f"{name} {leaf}"
            for name, leaf in leaves.items()
        )
    return (
        text if len(text) <= _LONGEST_TEXT else f"{text[:_LONGEST_TEXT]} … ({len(text)} characters)"
    )


def microseconds(time: float) -> str:
    """Return a time in s as text in µs."""
    return f"{time * 1e6:.7g} µs"


def _measurement_facts(measurement: Measurement, time: float | None) -> _Rows:
    data, kelvins = measurement.data, measurement.radiance_temperature()
    index = shown_frame(measurement.times, time, "measurement")
    yield from _where_and_when("pixels", measurement.raster, measurement.times)
    if "integration_time" in data.attrs:
        yield "integration time", microseconds(float(data.attrs["integration_time"]))
    if "lower_limit" in data.attrs:
        yield "lower range limit", f"{float(data.attrs['lower_limit']) - ZERO_CELSIUS:.4g} °C"
    if {"netd", "netd_temperature"} <= set(data.attrs):
        netd, at = (float(data.attrs[name]) for name in ("netd", "netd_temperature"))
        yield "NETD", f"{1e3 * netd:.3g} mK at {at - ZERO_CELSIUS:.4g} °C, half of the range filled"
    if {"band_lower", "band_upper"} <= set(data.attrs):
        band, shape = measurement.band, ""
        if band.response is not None:
            wavelengths = 1e6 * band.wavelengths
            values = np.asarray(band.response(band.wavelengths))
            mean, peak = np.average(wavelengths, weights=values), wavelengths[values.argmax()]
            shape = f", response with its mean at {mean:.4g} µm and its peak at {peak:.4g} µm"
        yield "band", f"{1e6 * band.lower:.4g} µm to {1e6 * band.upper:.4g} µm{shape}"
    if measurement.tool is not None:
        yield "tool", _tool_text(measurement.tool)
    yield "radiance temperature", _celsius(kelvins)
    yield f"at {microseconds(measurement.times[index])}", _celsius(kelvins[index])
    uncertainty = measurement.calibration_uncertainty
    if uncertainty is None or not np.isfinite(kelvins).any():
        yield "its calibration", "uncertainty not known"
    else:
        uncertainty = uncertainty / measurement.band.slope(kelvins)
        least, largest = float(np.nanmin(uncertainty)), float(np.nanmax(uncertainty))
        yield "its calibration", f"standard uncertainty {least:.2g} K to {largest:.2g} K"
    yield "usable pixels", f"{100 * np.mean(measurement.usable):.4g} %"
    fractions = flag_fractions(measurement)
    for flag, name in _FLAG_NAMES.items():
        if fractions[flag]:
            yield name, f"{100 * fractions[flag]:.3g} %"


def _celsius(kelvins: NDArray[np.float64]) -> str:
    known = kelvins[np.isfinite(kelvins)] - ZERO_CELSIUS
    if known.size == 0:
        return "none: no pixel is usable"
    least, median, largest = (f"{one:.1f} °C" for one in np.quantile(known, (0.0, 0.5, 1.0)))
    return f"{least} to {largest}, median {median}"
