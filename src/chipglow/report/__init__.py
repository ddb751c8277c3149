"""The report of an analysis: page, figures, numbers and arrays; pictures of scenes; movies."""

from chipglow.report.attribution import attribution_sentence as attribution_sentence
from chipglow.report.movie import (
    CutPicture as CutPicture,
    MovieScales as MovieScales,
    cut_movie as cut_movie,
)
from chipglow.report.paper import QUICK as QUICK
from chipglow.report.report import write_report as write_report
from chipglow.report.rows import (
    Row as Row,
    result_rows as result_rows,
    results_frame as results_frame,
)
from chipglow.report.scene_figure import draw_scene as draw_scene
from chipglow.report.scene_summary import (
    QualitySummary as QualitySummary,
    SceneSummary as SceneSummary,
    scene_summary as scene_summary,
)
