"""What the page gives away: the study, a figure, the measurement."""

import re
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from chipglow.app.figures import LINE_COLOURS
from chipglow.app.knobs import LINE_NAMES, LINES, SHOWN, Knobs
from chipglow.app.model import SceneModel
from chipglow.app.picture import Picture
from chipglow.drawing.drawing import ImagePanel, draw_line, length_unit, new_figure, style
from chipglow.drawing.scales import BLUE, GREY, HEAT, KELVIN, PLAIN, SIGNED, ends, round_limit
from chipglow.io import StoredScene, write_dataset
from chipglow.study import study_text

_IMAGE_WIDTH, _LINES_HEIGHT = 1.35, 2.2
"""Width of an image and height of the plots of lines in inches."""


def study_file(model: SceneModel, knobs: Knobs) -> bytes:
    """The study that the knobs mean, as YAML; its scene is that which is open, if it is a file."""
    study = model.panel.study_of(knobs)
    scene = model.opened.scene
    if model.opened.from_file and isinstance(scene, StoredScene):
        study = study.model_copy(update={"scene": str(scene.path.resolve())})
    start = model.panel.knob("start").text(knobs.start)
    seen = f"# Seen in the exposure that begins at {start}:\n"
    if study.scene is not None:
        seen += f"# chipglow measure {study.scene} --study FILE --start '{start}' --out FILE.nc\n"
    return (seen + study_text(study)).encode()


def measurement_file(picture: Picture, model: SceneModel) -> bytes:
    """The measurement as NetCDF, with the reference temperature and the error of every pixel."""
    assert picture.camera is not None and picture.errors is not None
    measurement = picture.camera.form_measurement(picture.exposures[0])
    tool = model.opened.scene.tool
    if tool is not None:
        measurement = measurement.with_tool(tool)
    place, units = ("time", "y", "x"), {"units": "K"}
    data = measurement.data.assign(
        reference_temperature=(place, picture.errors.reference[None], units),
        error=(place, picture.errors.case_1[None], units),
        error_without_psf=(place, picture.errors.case_2[None], units),
    )
    with TemporaryDirectory() as folder:
        path = Path(folder, "measurement.nc")
        write_dataset(data, path)
        return path.read_bytes()


def figure_file(picture: Picture, model: SceneModel) -> bytes:
    """The images and the lines as PNG."""
    with style(), TemporaryDirectory() as folder:
        path = Path(folder, "figure.png")
        _figure(picture, model).savefig(path, dpi=200)
        return path.read_bytes()


def _figure(picture: Picture, model: SceneModel) -> Figure:
    assert picture.scene is not None and picture.error is not None
    tool, knobs = model.opened.scene.tool, picture.knobs
    raster = picture.raster
    upper = 0.7 + _IMAGE_WIDTH * raster.rows / raster.columns
    figure = new_figure(upper + _LINES_HEIGHT)
    grid = figure.add_gridspec(2, 1, height_ratios=(upper, _LINES_HEIGHT))
    top, bottom = (figure.add_subfigure(grid[row]) for row in (0, 1))
    images, plots = top.subplots(1, 3), bottom.subplots(1, 3)
    measured = np.where(picture.flagged, np.nan, picture.measured) - KELVIN
    error = np.where(picture.flagged, np.nan, picture.error)
    limit = round_limit(error, 98, 5.0)
    shown = picture.scene.shown
    part = model.panel.knob("error").choices or {}
    panels = (
        ImagePanel(
            SHOWN[picture.scene.name],
            picture.scene.label,
            shown,
            ends(shown),
            HEAT if picture.scene.is_temperature else PLAIN,
        ),
        ImagePanel("Radiance temperature", "measured / °C", measured, ends(measured), HEAT),
        ImagePanel(part[knobs.error], "error / K", error, (-limit, limit), SIGNED),
    )
    rasters = (picture.scene.raster, picture.raster, picture.raster)
    for panel, raster, one in zip(panels, rasters, images, strict=True):
        panel.draw(top, one, raster, tool)
        for name in LINES:
            corners = np.array(getattr(knobs, name))
            draw_line(one, corners, LINE_COLOURS[name], factor=length_unit(raster)[0])
    for name, one in zip(LINES, plots, strict=False):
        values = picture.lines[name]
        assert values.reference is not None
        along = 1e6 * values.distance
        one.plot(along, values.reference - KELVIN, color=GREY, label="reference")
        one.plot(along, values.measured - KELVIN, color=BLUE, label="measured")
        one.set_title(LINE_NAMES[name].capitalize(), color="black")
        one.set(xlabel="distance / µm", ylabel="radiance temperature / °C")
    plots[2].axis("off")
    plots[2].text(0, 1, _caption(picture, model), va="top", fontsize=7.5)
    plots[2].legend(*plots[0].get_legend_handles_labels(), loc="lower left")
    return figure


def _caption(picture: Picture, model: SceneModel) -> str:
    """What the camera is, a line for each knob that is not at its first value."""
    knobs = picture.knobs
    texts = {"start": model.panel.knob("start").text(knobs.start), **model.panel.texts(knobs)}
    known = {knob.name: knob.label for knob in model.panel.knobs}
    rows = [f"{known[name]}: {text}" for name, text in texts.items() if name in known]
    return re.sub(r"\bu(m|s)\b", r"µ\1", "\n".join([model.opened.name, *rows]))
