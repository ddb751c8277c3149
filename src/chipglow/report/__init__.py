"""The report of an analysis: page, figures, numbers and arrays."""

from chipglow.report.attribution import attribution_sentence as attribution_sentence
from chipglow.report.paper import QUICK as QUICK
from chipglow.report.report import write_report as write_report
from chipglow.report.rows import (
    Row as Row,
    result_rows as result_rows,
    results_frame as results_frame,
)
