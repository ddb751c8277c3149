"""The report: the paper's figures beside ours, as a page, pictures, numbers and arrays; movies."""

from chipglow.report.band_figure import draw_band_profile
from chipglow.report.calibration_figure import draw_calibrations
from chipglow.report.compare_figure import draw_comparison
from chipglow.report.comparison import Row, comparison_rows
from chipglow.report.emissivity_figure import draw_emissivity
from chipglow.report.knife_edge_figure import draw_knife_edge
from chipglow.report.measurement_figure import draw_measurement
from chipglow.report.measurement_summary import MeasurementSummary, measurement_summary
from chipglow.report.movie import CutPicture, MovieScales, cut_movie
from chipglow.report.paper import QUICK, table_2
from chipglow.report.rake_figure import draw_rake_grid
from chipglow.report.registration_figure import blink_pictures, draw_registration
from chipglow.report.report import write_report
from chipglow.report.scene_figure import draw_scene
from chipglow.report.scene_summary import (
    FieldSummary,
    QualitySummary,
    SceneSummary,
    ShownField,
    scene_summary,
)

__all__ = [
    "QUICK",
    "CutPicture",
    "FieldSummary",
    "MeasurementSummary",
    "MovieScales",
    "QualitySummary",
    "Row",
    "SceneSummary",
    "ShownField",
    "blink_pictures",
    "comparison_rows",
    "cut_movie",
    "draw_band_profile",
    "draw_calibrations",
    "draw_comparison",
    "draw_emissivity",
    "draw_knife_edge",
    "draw_measurement",
    "draw_rake_grid",
    "draw_registration",
    "draw_scene",
    "measurement_summary",
    "scene_summary",
    "table_2",
    "write_report",
]
