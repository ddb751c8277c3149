"""The report: the paper's figures beside ours, as a page, pictures, numbers and arrays; movies."""

from chipglow.report.comparison import Row, comparison_rows
from chipglow.report.movie import CutPicture, MovieScales, cut_movie
from chipglow.report.report import write_report

__all__ = ["CutPicture", "MovieScales", "Row", "comparison_rows", "cut_movie", "write_report"]
