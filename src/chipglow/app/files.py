"""The files that the page saves: the study, a figure, the measurement."""

import re
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.app.controls import LINES, State
from chipglow.app.figures import LINE_COLOURS
from chipglow.app.pictures import Drawn, Picture, SceneModel
from chipglow.drawing.drawing import (
    colour_bar,
    draw_line,
    length_unit,
    new_figure,
    show_image,
    style,
)
from chipglow.drawing.scales import BLUE, GREY, VOID
from chipglow.io import StoredScene, write_dataset
from chipglow.quantities import unchecked
from chipglow.study import study_text

View: TypeAlias = tuple[float, float, float, float]
"""Visible part of the images: left, right, bottom and top in m."""

_IMAGE_WIDTH, _LINES_HEIGHT = 1.95, 2.4
"""Width of an image and height of the plots of lines in inches."""


def study_file(model: SceneModel, state: State) -> bytes:
    """Return the study of a state as YAML; it names the open scene if that is a file."""
    study, scene = state.study, model.opened.scene
    if model.opened.from_file and isinstance(scene, StoredScene):
        study = unchecked(study, scene=str(scene.path.resolve()))
    start = model.controls.row("start").text(state.start)
    comment = f"# Exposure that begins at {start}:\n"
    if study.scene is not None:
        comment += (
            f"# chipglow measure {study.scene} --study FILE --start '{start}' --out FILE.nc\n"
        )
    return (comment + study_text(study)).encode()


def measurement_file(picture: Picture, model: SceneModel) -> bytes:
    """Return the measurement as NetCDF, with reference and error of every pixel."""
    assert picture.camera and picture.exposure
    measurement = picture.camera.form_measurement(picture.exposure)
    if model.opened.scene.tool is not None:
        measurement = measurement.with_tool(model.opened.scene.tool)
    place, units = ("time", "y", "x"), {"units": "K"}
    data = measurement.data.assign(
        reference_temperature=(place, picture.data["reference"].values[None], units),
        error=(place, picture.data["case_1"].values[None], units),
        error_without_psf=(place, picture.data["case_2"].values[None], units),
    )
    with TemporaryDirectory() as folder:
        path = Path(folder, "measurement.nc")
        write_dataset(data, path)
        return path.read_bytes()


def figure_file(
    picture: Picture, model: SceneModel, view: View, drawn: Drawn | None = None
) -> bytes:
    """Return the visible part of the images, the lines and the draws as PNG."""
    with style(), TemporaryDirectory() as folder:
        path = Path(folder, "figure.png")
        figure = _figure(picture, model, view, drawn)
        figure.savefig(path, dpi=200, bbox_inches="tight", pad_inches=0.05)
        return path.read_bytes()


def _figure(picture: Picture, model: SceneModel, view: View, drawn: Drawn | None) -> Figure:
    left, right, bottom, top = view
    upper = 1.1 + _IMAGE_WIDTH * (top - bottom) / (right - left)
    figure = new_figure(upper + _LINES_HEIGHT)
    axes = figure.subplots(2, 3, height_ratios=(upper, _LINES_HEIGHT))
    _draw_images(figure, axes[0], picture, model, view)
    for name, one in zip(LINES, axes[1], strict=False):
        _draw_line(one, name, picture, drawn)
    axes[1, 0].legend(frameon=False, fontsize=6.5)
    axes[1, 1].set_ylabel("")
    axes[1, 2].axis("off")
    axes[1, 2].text(0, 1, _caption(picture.state, model), va="top", fontsize=6)
    return figure


def _draw_images(
    figure: Figure, axes: Any, picture: Picture, model: SceneModel, view: View
) -> None:
    state, tool = picture.state, model.opened.scene.tool
    factor, _ = length_unit(model.opened.scene.raster)
    left, right, bottom, top = (factor * edge for edge in view)
    for one, panel in zip(axes, picture.panels.values(), strict=True):
        image = show_image(one, panel.values, panel.raster, tool, panel.colours, panel.limits)
        colour_bar(figure, image, one, panel.unit, "bottom")
        one.set_title(panel.name, fontsize=8)
        for name in LINES:
            draw_line(one, state.line(name).outline(), LINE_COLOURS[name], factor=factor)
        for colour, width in (("black", 2.6), ("white", 1.2)):
            one.plot(*factor * np.array(state.cursor), "+", color=colour, mew=width, ms=7)
        one.set(xlim=(left, right), ylim=(bottom, top))
        if one is not axes[0]:
            one.set(ylabel="", yticklabels=[])


def _draw_line(axes: Axes, name: str, picture: Picture, drawn: Drawn | None) -> None:
    values = picture.lines[name]
    if drawn is not None:
        low, high = drawn.lines[name].min(axis=0), drawn.lines[name].max(axis=0)
        axes.fill_between(
            values["along"], low, high, color=BLUE, alpha=0.25, lw=0, label="range of draws"
        )
    axes.plot(values["along"], values["reference"], "--", color=GREY, label="reference")
    axes.plot(values["along"], values["measured"], color=BLUE, label="measured")
    axes.set_title(LINES[name].capitalize(), color="black")
    axes.set(xlabel="distance / µm", ylabel="radiance temp. / °C")
    limit, (low, high) = picture.lower_limit, axes.get_ylim()
    if limit is not None and limit > low:
        axes.axhspan(low, limit, color=VOID, zorder=0)
        axes.set_ylim(low, high)


def _caption(state: State, model: SceneModel) -> str:
    """Return camera and surface: a line for each control."""
    lines, controls = [model.opened.name], model.controls
    for row in controls.rows:
        if row.group and not row.path.endswith("_image") and controls.is_shown(row, state):
            value = controls.value(row, state)
            text = row.options[value].label if row.options else row.text(value)
            lines.append(f"{row.label}: {text}")
    return re.sub(r"\bdegC\b", "°C", re.sub(r"\bu(m|s)\b", r"µ\1", "\n".join(lines)))
