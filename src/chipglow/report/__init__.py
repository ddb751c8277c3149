"""The report: the paper's figures beside ours, as a page, pictures, numbers and arrays; movies."""

from chipglow.report.comparison import Row, comparison_frame, comparison_rows
from chipglow.report.movie import CutPicture, MovieScales, cut_movie
from chipglow.report.paper import QUICK, table_2
from chipglow.report.report import write_report
from chipglow.report.scene_figure import draw_scene
from chipglow.report.scene_report import place_rows, write_scene_report
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
    "MovieScales",
    "QualitySummary",
    "Row",
    "SceneSummary",
    "ShownField",
    "comparison_frame",
    "comparison_rows",
    "cut_movie",
    "draw_scene",
    "place_rows",
    "scene_summary",
    "table_2",
    "write_report",
    "write_scene_report",
]
