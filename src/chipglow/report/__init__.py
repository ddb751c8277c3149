"""The report of an analysis: page, figures, numbers and arrays; pictures of scenes; movies."""

from chipglow.report.movie import CutPicture, MovieScales, cut_movie
from chipglow.report.paper import QUICK
from chipglow.report.report import write_report
from chipglow.report.rows import Row, result_rows, results_frame
from chipglow.report.scene_figure import draw_scene
from chipglow.report.scene_summary import QualitySummary, SceneSummary, scene_summary

__all__ = [
    "QUICK",
    "CutPicture",
    "MovieScales",
    "QualitySummary",
    "Row",
    "SceneSummary",
    "cut_movie",
    "draw_scene",
    "result_rows",
    "results_frame",
    "scene_summary",
    "write_report",
]
