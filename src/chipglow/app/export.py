"""Files of measured places: tables as CSV and Excel, and the picture as PNG."""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from io import BytesIO
from typing import Any, Final

import numpy as np
import pandas as pd

from chipglow import __version__
from chipglow.app.marks import Mark
from chipglow.laboratory.emissivity.places import ImageView
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.scene import Raster
from chipglow.text import needs_extra

_PALETTES: Final = {"grey": "gray"}
"""Names that Matplotlib has for palettes, as far as they differ."""

_HEIGHT: Final = 5.0
"""Height of the picture in inches."""


def csv_file(frame: pd.DataFrame) -> bytes:
    """Return a table as CSV: numbers have nine digits, NaN is an empty cell."""
    text: str = frame.to_csv(index=False, float_format="%.9g", lineterminator="\r\n")
    return text.encode("utf-8-sig")  # with its mark Excel reads µ and ° in it


def workbook(tables: Mapping[str, pd.DataFrame], settings: Mapping[str, str]) -> bytes:
    """Return tables and settings as sheets of an Excel workbook."""
    if find_spec("openpyxl") is None:
        raise ValueError(needs_extra("xlsx", "openpyxl", "app"))
    file = BytesIO()
    with pd.ExcelWriter(file, engine="openpyxl") as writer:
        for name, table in tables.items():
            table.to_excel(writer, sheet_name=name, index=False)
        rows = pd.DataFrame(settings.items(), columns=["setting", "value"])
        rows.to_excel(writer, sheet_name="settings", index=False)
    return file.getvalue()


def picture_file(
    celsius: Array,
    raster: Raster,
    title: str,
    marks: Sequence[Mark],
    view: ImageView,
    limits: tuple[float, float],
    settings: Mapping[str, str],
) -> bytes:
    """Return the image with its places and isotherm as PNG, with the settings in its metadata.

    Limits and values are in °C. The metadata are texts of the PNG format, by the names of the
    settings.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from chipglow.drawing.drawing import DPI, style
    from chipglow.drawing.scales import GREY

    left, right, bottom, top = (1e6 * edge for edge in raster.extent)
    with style():
        width = max(_HEIGHT * (right - left) / (top - bottom), _HEIGHT) + 1.5
        figure = Figure(figsize=(min(width, 3 * _HEIGHT), _HEIGHT), layout="compressed")
        FigureCanvasAgg(figure)
        axes = figure.subplots()
        shown = axes.imshow(
            celsius,
            extent=(left, right, bottom, top),
            cmap=_PALETTES.get(view.palette, view.palette),
            vmin=limits[0],
            vmax=limits[1],
        )
        axes.set_facecolor(GREY)  # shows where there is no value
        figure.colorbar(shown, label=title, shrink=0.8)
        if view.isotherm is not None and np.isfinite(celsius).any():
            level = view.isotherm - ZERO_CELSIUS
            axes.contour(
                1e6 * raster.x,
                1e6 * raster.y,
                celsius,
                [level],
                colors="white",
                linestyles="dashed",
            )
        for mark in marks:
            x, y = 1e6 * mark.outline.T
            for colour, wide in (("black", 2.4), ("white", 1.2)):
                axes.plot(x, y, color=colour, linewidth=wide, marker="+" if len(x) == 1 else "")
            axes.annotate(
                mark.name, (x[0], y[0]), xytext=(3, 3), textcoords="offset points", color="white"
            )
        axes.set(xlabel="x / µm", ylabel="y / µm")
        file = BytesIO()
        metadata: dict[str, Any] = {"Software": f"chipglow {__version__}", **settings}
        figure.savefig(file, dpi=DPI, metadata=metadata)
    return file.getvalue()
