"""The command ``chipglow show`` for scenes."""

import json
from collections.abc import Iterator, Mapping
from math import degrees
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.cli.finish import figure, finish
from chipglow.cli.screen import current
from chipglow.cli.times import parse_instant
from chipglow.drawing.frames import shown_frame
from chipglow.io import StoredScene, is_scene, open_scene
from chipglow.io.measurement_file import holds
from chipglow.report import SceneSummary, draw_scene, scene_summary
from chipglow.scene import ENERGY_UNITS, Raster, Scene, Tool, ToolGeometry
from chipglow.text import Notes

_LONGEST: Final = 800
_MOST_NUMBERS: Final = 8

_Rows: TypeAlias = Iterator[tuple[str, str]]


def show_scene(path: Path, at: str | None, plot: Path | None) -> None:
    """Print the contents of a scene and optionally draw it."""
    scene = open_scene(path)
    time = None if at is None else _time_in(scene, at)
    summary = scene_summary(scene, time)
    screen = current()
    screen.facts("scene", _facts(scene, path))
    screen.heading(f"\nAt {microseconds(scene.times[summary.index])}:")
    screen.facts("state", _state(summary))
    screen.heading()
    _show_fields(summary)
    screen.values(raster_values(scene.raster, scene.times))
    screen.values({"at_us": 1e6 * scene.times[summary.index]})
    show_attributes(_other_attributes(scene))
    finish(Notes(), (plot, figure(draw_scene, scene, time)))
    scene.data.close()


def check_shown(path: Path) -> None:
    """Raise an error if a file is neither a scene nor similar to one."""
    if path.is_file() and not holds(path, ()):
        raise ValueError(
            f"{path}: not a NetCDF-4 file, or truncated; expected a scene or measurement "
            "(chipglow convert inspects camera files)"
        )
    if path.is_file() and not is_scene(path):
        raise ValueError(
            f"{path}: contains neither temperature nor radiance; expected a scene or measurement"
        )


def _time_in(scene: Scene, at: str) -> float:
    time = parse_instant("--at", at)
    try:
        shown_frame(scene.times, time, "scene")
    except ValueError as error:
        raise ValueError(f"--at: {error}") from None
    return time


def _facts(scene: StoredScene, path: Path) -> _Rows:
    raster, times, data = scene.raster, scene.times, scene.data
    yield from where_and_when("samples", raster, times)
    yield "tool", _tool_text(scene.tool) if scene.tool else "not given"
    yield "material coordinates", "yes" if scene.has_material_coordinates else "no"
    if "force_time" in data:
        span = data["force_time"].values
        energies = ", with energies" if set(ENERGY_UNITS) <= set(data) else ""
        yield "forces", f"{span.size} records{energies}"
    size = path.stat().st_size
    each = size / (len(times) * raster.rows * raster.columns)
    yield "file", f"{size / 1e6:,.1f} MB, {each:.2g} bytes a sample ({scene.compression})"


def where_and_when(name: str, raster: Raster, times: NDArray[np.float64]) -> _Rows:
    """Describe the positions of samples or pixels, and the times of the frames."""
    left, right, bottom, top = (f"{1e6 * edge:.6g} µm" for edge in raster.extent)
    yield name, f"{raster.columns} x {raster.rows} of {1e6 * raster.spacing:.6g} µm"
    yield "x", f"{left} to {right}"
    yield "y", f"{bottom} to {top}"
    yield "frames", f"{len(times)}, {microseconds(times[0])} to {microseconds(times[-1])}"
    if len(times) > 1:
        yield "interval", _interval_text(np.diff(times))


def _interval_text(steps: NDArray[np.float64]) -> str:
    """Return the interval of the frames, or its range."""
    least, mean, greatest = (float(f(steps)) for f in (np.min, np.mean, np.max))
    if greatest - least < 1e-3 * mean:
        return microseconds(mean)
    return f"{microseconds(least)} to {microseconds(greatest)}"


def _tool_text(tool: Tool) -> str:
    text = f"rake {degrees(tool.rake_angle):.4g}°, clearance {degrees(tool.clearance_angle):.4g}°"
    if not isinstance(tool, ToolGeometry):
        return f"{text}, outline of {len(tool.corners)} points"
    parts = [text, f"edge radius {1e6 * tool.edge_radius:.4g} µm"]
    parts += ["chamfer"] * (tool.chamfer is not None) + ["hone"] * (tool.hone is not None)
    return ", ".join(parts)


def _state(summary: SceneSummary) -> _Rows:
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


def raster_values(raster: Raster, times: NDArray[np.float64]) -> dict[str, Any]:
    """Return the numbers of `where_and_when`."""
    return {
        "rows": raster.rows,
        "columns": raster.columns,
        "spacing_um": 1e6 * raster.spacing,
        "extent_um": [1e6 * edge for edge in raster.extent],
        "times_us": 1e6 * times,
    }


def _show_fields(summary: SceneSummary) -> None:
    everywhere = f"in {len(summary.sampled)} frames"
    columns = {everywhere if name == "overall" else name: name for name in summary.fields}
    current().table("fields", summary.fields, columns, "Over the material", unbroken=("field",))


def show_attributes(attributes: Mapping[str, Any]) -> None:
    """Print the attributes of a file, if any, below a heading."""
    if not attributes:
        return
    screen = current()
    screen.heading("\nAttributes:")
    screen.facts("attributes", attribute_rows(attributes))
    screen.values({"attributes": attributes})


def _other_attributes(scene: Scene) -> dict[str, Any]:
    """Return the attributes of a scene without those of the tool."""
    attributes = scene.data.attrs.items()
    return {str(name): value for name, value in attributes if not str(name).startswith("tool_")}


def attribute_rows(attributes: Mapping[str, Any]) -> _Rows:
    """Return attributes as texts of limited length."""
    for name, value in attributes.items():
        yield name, _shortened(_attribute_text(value))


def _attribute_text(value: Any) -> str:
    """Return an attribute as text; JSON is flattened by its keys."""
    if not isinstance(value, str):
        return str(value)
    try:
        parsed = json.loads(value)
    except (ValueError, RecursionError):
        return value
    return ", ".join(_leaves("", parsed)) if isinstance(parsed, dict) else value


def _leaves(name: str, value: Any) -> Iterator[str]:
    if isinstance(value, dict) and value:
        for key, inner in value.items():
            yield from _leaves(f"{name}.{key}" if name else str(key), inner)
    elif isinstance(value, list) and len(value) > _MOST_NUMBERS:
        yield f"{name} [{len(value)} values]"
    else:
        yield f"{name} {value}"


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} … ({len(text)} characters)"


def microseconds(time: float) -> str:
    """Return a time in s as text in µs."""
    return f"{time * 1e6:.7g} µs"
