"""Results as frames: their cells in CSV files and on the terminal."""

import numpy as np
import pandas as pd
from rich.console import Console

from chipglow.cli.tables import screen_table
from chipglow.io.result_file import write_frame
from chipglow.laboratory.registration import fit_points
from chipglow.scene import Raster

RASTER = Raster(0.0, 1e-3, 1e-5, 100, 100)

FRAME = pd.DataFrame(
    {
        "name": ["one", "other", "third"],
        "count": [1, 20, 0],
        "value_K": [1 / 3, np.nan, 812.5],
        "uncertainty_K": [0.0512, np.nan, np.nan],
    }
)


def test_cells_have_nine_digits_and_are_empty_where_nothing_is_known(tmp_path):
    write_frame(FRAME, tmp_path / "frame.csv")
    assert (tmp_path / "frame.csv").read_text(encoding="utf-8").splitlines()[:3] == [
        "name,count,value_K,uncertainty_K",
        "one,1,0.333333333,0.0512",
        "other,20,,",
    ]


def test_a_dash_stands_where_nothing_is_known():
    console = Console(width=60)
    with console.capture() as captured:
        console.print(screen_table(FRAME, ["name", "value_K ± uncertainty_K"], "title"))
    lines = [line.split() for line in captured.get().splitlines()]
    assert lines[1:] == [
        ["name", "value", "/", "K"],
        ["one", "0.333", "±", "0.051"],
        ["other", "–"],
        ["third", "812.5"],
    ]


def test_points_are_a_frame_with_how_far_off_they_are():
    places = np.array([[0.0, 0.0], [1e-3, 0.0], [0.0, 1e-3], [1e-3, 1e-3]])
    pixels = places * 1e5 + [[0.0, 0.4], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
    fit = fit_points(places, pixels)
    frame = fit.to_frame()
    assert frame["point"].tolist() == [1, 2, 3, 4]
    np.testing.assert_allclose(frame["x_um"], [0.0, 1000.0, 0.0, 1000.0])
    # Least squares of a plane spread an error at one corner over all four.
    np.testing.assert_allclose(frame["residual"], 0.1, rtol=1e-12)
    size, turn, mirrored = fit.registration.geometry(RASTER)
    assert (round(size * 1e6), mirrored) == (10, True)
    assert abs(turn) < 0.5  # degrees: an error of one corner turns the map by 0.1
