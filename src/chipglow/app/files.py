"""Files of the page and pictures by Matplotlib: study, measurement, the whole chip."""

from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from matplotlib import rc_context

from chipglow.app.controls import State
from chipglow.app.opening import SHOWN, SHOWN_LINE
from chipglow.app.pictures import Picture
from chipglow.app.scene_model import SceneModel
from chipglow.drawing.drawing import data_url, style
from chipglow.io import write_dataset
from chipglow.quantities import unchecked
from chipglow.scene import Scene
from chipglow.scene.figures import draw_chip
from chipglow.study import Study, study_text

_COLOURED: Final = (
    "text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"
)  # fmt: skip


def study_file(model: SceneModel, state: State) -> bytes:
    """Return the study of a state as YAML; it names the open scene unless that is its cut.

    A comment holds what is shown, which is not part of a study: see `SHOWN`.
    """
    shown, scene = state.study, model.file
    given = {name: getattr(shown, name) for name in Study.declared().keys() & shown.given}
    study = unchecked(Study(), **{**given, "scene": scene})
    values = model.controls.values(state)
    start = values["start"]
    is_shown = ", ".join(f"{name}: {values[name]}" for name in SHOWN)
    comment = f"{SHOWN_LINE}{{{is_shown}}}\n"
    if scene is not None:
        comment += f"# chipglow measure {scene} --study FILE --start '{start}' --out FILE.nc\n"
    return (comment + study_text(study)).encode()


def measurement_file(picture: Picture, model: SceneModel) -> bytes:
    """Return the measurement as NetCDF, with reference and error of every pixel."""
    assert picture.camera and picture.exposure
    measurement = picture.camera.form_measurement(picture.exposure)
    if model.scene.tool is not None:
        measurement = measurement.with_tool(model.scene.tool)
    place, units = ("time", "y", "x"), {"units": "K"}
    against = units | {"reference": picture.state.study.analysis.reference}
    data = measurement.data.assign(
        reference_temperature=(place, picture.data["reference"].values[None], against),
        error=(place, picture.data["case_1"].values[None], units),
        error_without_psf=(place, picture.data["case_2"].values[None], units),
    )
    with TemporaryDirectory() as folder:
        path = Path(folder, "measurement.nc")
        write_dataset(data, path)
        return path.read_bytes()


def chip_picture(scene: Scene, colour: str) -> str:
    """Return a picture of the whole chip with text in a colour, as the address of a PNG."""
    assert scene.overview is not None
    file = BytesIO()
    with style(), rc_context(dict.fromkeys(_COLOURED, colour)):
        draw_chip(scene.overview, scene.raster, scene.tool).savefig(file, dpi=110, transparent=True)
    return data_url(file.getvalue())
