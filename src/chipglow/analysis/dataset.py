"""The variables of an analysis' Dataset that are not readings: scene, images, ridges, forces."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.analysis.looks import Looked, Schedule
from chipglow.analysis.result import CuttingForces
from chipglow.camera import Measurement
from chipglow.laboratory.chip import ChipMetrics, Instant
from chipglow.scene import FIELD_UNITS, Frame, Raster, sample

Variables: TypeAlias = dict[str, Any]
_SHOWN_FIELDS = ("temperature", "plastic_strain", "plastic_strain_rate", "material")
_PIXELS = ("pixel_y", "pixel_x")
_COORDINATES = ("place", "quantity", "seen_surface", "textures", "line_surface", "line_textures")


def scene_variables(
    frame: Frame,
    raster: Raster,
    emissivities: Sequence[NDArray[np.float32]],
    temperatures: Sequence[NDArray[np.float64]],
) -> Variables:
    """The scene at the shown exposure, and its emissivity and radiance temperature by surface."""
    known = {name: getattr(frame, name) for name in _SHOWN_FIELDS}
    return {
        "y": ("y", raster.y, {"units": "m"}),
        "x": ("x", raster.x, {"units": "m"}),
        **{
            name: (("y", "x"), values, {"units": FIELD_UNITS[name]})
            for name, values in known.items()
            if values is not None
        },
        "emissivity": (("surface", "y", "x"), np.stack(emissivities), {"units": "1"}),
        "scene_radiance_temperature": (
            ("surface", "y", "x"),
            np.stack(temperatures).astype(np.float32),
            {"units": "K"},
        ),
    }


def image_variables(
    measurements: Sequence[Measurement],
    references: Sequence[NDArray[np.float64]],
    measured: NDArray[np.float64],
    flagged: NDArray[np.bool_],
) -> Variables:
    """What the camera makes of every instant, and of the shown one with and without effects.

    `measured` has shape (surface, effects, y, x), `flagged` (surface, y, x).
    """
    first = measurements[0]
    images = {
        "radiance_temperature": np.stack([one.radiance_temperature() for one in measurements]),
        "reference_temperature": np.stack(references),
        "flags": np.stack([one.flags for one in measurements]),
    }
    over = ("surface", "instant", *_PIXELS)
    return {
        "instant": ("instant", first.times, {"units": "s"}),
        "pixel_y": ("pixel_y", first.raster.y, {"units": "m"}),
        "pixel_x": ("pixel_x", first.raster.x, {"units": "m"}),
        **{
            name: (over, values, {"units": "1" if name == "flags" else "K"})
            for name, values in images.items()
        },
        "image_measured": (("surface", "effects", *_PIXELS), measured, {"units": "K"}),
        "flagged": (("surface", *_PIXELS), flagged, {"units": "1"}),
    }


def ridge_variables(
    instants: Sequence[Instant], measurements: Mapping[str, Measurement]
) -> Variables:
    """The shear band's ridge in every instant, and what is measured along it."""
    bands = [instant.band for instant in instants]
    length = max(band.ridge.distance.size for band in bands if band is not None)
    of_band: dict[str, tuple[Sequence[NDArray[np.float64] | None], str]] = {
        "ridge_distance": ([b.ridge.distance if b else None for b in bands], "m"),
        "ridge_x": ([b.ridge.points[:, 0] if b else None for b in bands], "m"),
        "ridge_y": ([b.ridge.points[:, 1] if b else None for b in bands], "m"),
        "ridge_strain_rate": ([b.rate if b else None for b in bands], "1/s"),
        "ridge_width": ([b.widths if b else None for b in bands], "m"),
        "ridge_temperature": ([i.temperatures for i in instants], "K"),
    }
    curves = [padded(_curves(one, instants), length) for one in measurements.values()]
    return {
        **{
            name: (("instant", "ridge_point"), padded(values, length), {"units": unit})
            for name, (values, unit) in of_band.items()
        },
        "ridge_radiance_temperature": (
            ("surface", "instant", "ridge_point"),
            np.stack(curves),
            {"units": "K"},
        ),
    }


def history_variables(forces: CuttingForces | None, chip: ChipMetrics | None) -> Variables:
    """Forces and chip thickness over time, as far as they are known."""
    found: Variables = {}
    if forces is not None:
        found |= {
            "force_time": ("force_time", forces.time, {"units": "s"}),
            "cutting_force": ("force_time", forces.cutting, {"units": "N/m"}),
            "thrust_force": ("force_time", forces.thrust, {"units": "N/m"}),
        }
    if chip is not None:
        scan = chip.scan
        thickness = scan.thickness, {"units": "m", "height": scan.height}
        found |= {
            "chip_time": ("chip_time", scan.time, {"units": "s"}),
            "chip_thickness": ("chip_time", *thickness),
        }
    return found


def padded(rows: Sequence[NDArray[np.float64] | None], length: int) -> NDArray[np.float64]:
    """Rows of different lengths as one array, NaN beyond their ends."""
    values = np.full((len(rows), length), np.nan)
    for i, row in enumerate(rows):
        if row is not None:
            values[i, : row.size] = row
    return values


def _curves(
    measurement: Measurement, instants: Sequence[Instant]
) -> list[NDArray[np.float64] | None]:
    """Measured radiance temperature along the ridges, whether under the lower limit or not."""
    frames = np.asarray(measurement.band.temperature(measurement.radiance))
    return [
        None if one.band is None else sample(frame, measurement.raster, one.band.ridge.points)
        for frame, one in zip(frames, instants, strict=True)
    ]


def assembled(variables: Variables, attributes: Mapping[str, Any]) -> xr.Dataset:
    """The Dataset of all variables."""
    data = xr.Dataset(variables, attrs=dict(attributes))
    return data.set_coords([name for name in _COORDINATES if name in data])


def drawn_variables(
    looked: Looked, schedule: Schedule, names: Mapping[tuple[str, str], str], cause: str
) -> Variables:
    """Readings and lines over all draws.

    `names` are those of readings by place and quantity, and `cause` says what an exposure is.
    """
    views = schedule.views
    several = not names and len(views) > 1

    def named(view: int, text: str) -> str:
        return f"{text} ({views[view].surface})" if several else text

    rows, lines = list(looked.readings.rows), list(looked.lines.rows)
    readings, along, places = (
        table.stacked() for table in (looked.readings, looked.lines, looked.line_places)
    )
    over = ("exposure", "texture", "pixel_phase")
    kelvin, metre = {"units": "K"}, {"units": "m"}
    starts = schedule.starts[list(schedule.drawn)]
    variables: Variables = {
        "effects": ("effects", list(schedule.effects)),
        "exposure": ("exposure", starts, {"units": "s", "title": cause}),
        "texture": ("texture", np.arange(readings.shape[2])),
        "pixel_phase": ("pixel_phase", np.arange(readings.shape[3])),
        "reading": (
            "reading",
            [names.get((p, q), named(v, f"{p}, {q}")) for v, p, q in rows],
        ),
        "place": ("reading", [place for _, place, _ in rows]),
        "quantity": ("reading", [quantity for _, _, quantity in rows]),
        "seen_surface": ("reading", [views[view].surface for view, _, _ in rows]),
        "textures": ("reading", [views[view].textures for view, _, _ in rows]),
        "reference": (("reading", *over), readings[..., 0], kelvin),
        "measured": (("reading", *over, "effects"), readings[..., 1:], kelvin),
    }
    if lines:
        variables |= {
            "line": ("line", [named(view, line) for view, _, line in lines]),
            "line_surface": ("line", [views[view].surface for view, _, _ in lines]),
            "line_textures": ("line", [views[view].textures for view, _, _ in lines]),
            **{
                f"line_{name}": (("line", "exposure", "point"), places[:, :, i], metre)
                for i, name in enumerate(("distance", "x", "y"))
            },
            "line_reference": (("line", *over, "point"), along[..., 0, :], kelvin),
            "line_measured": (("line", *over, "effects", "point"), along[..., 1:, :], kelvin),
            "line_scene": (("line", *over[:2], "point"), looked.line_scene.stacked(), kelvin),
            "line_motion": (("line", *over[:2]), looked.line_motion.stacked()[..., 0], kelvin),
        }
    if schedule.vary:
        varied = looked.varied.stacked()
        varied = varied.reshape(len(rows), 2, -1, *varied.shape[2:])
        dims = ("reading", "psf_order", "psf_width", "exposure", "pixel_phase")
        variables["varied_reference"] = dims, varied[..., 0], kelvin
        variables["varied_measured"] = (*dims, "effects"), varied[..., 1:], kelvin
    return variables
