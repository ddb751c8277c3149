"""The report: the paper's figures beside ours, as a page, pictures, numbers and arrays."""

from chipglow.report.comparison import Row, comparison_rows
from chipglow.report.report import write_report

__all__ = ["Row", "comparison_rows", "write_report"]
