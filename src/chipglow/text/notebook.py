"""Results in a notebook: their table, with the notes below it."""

from html import escape
from typing import TYPE_CHECKING, Final

from chipglow.text.notes import Notes

if TYPE_CHECKING:
    import pandas as pd

_SHOWN_ROWS: Final = 20
"""Rows up to which a table is shown in full; of longer ones, the first and the last."""


def result_html(name: str, table: "pd.DataFrame", notes: Notes) -> str:
    """Return the name of a result, its table and its notes as HTML."""
    text = table.to_html(
        index=False,
        max_rows=_SHOWN_ROWS,
        show_dimensions=True,
        border=0,
        na_rep="–",
        float_format="{:.6g}".format,
    )
    parts = [f"<p><b>{escape(name)}</b></p>", text]
    named = {"Warnings": notes.warnings, "Assumed": notes.assumed, "Remarks": notes.remarks}
    for title, sentences in named.items():
        if sentences:
            items = "".join(f"<li>{escape(one)}</li>" for one in sentences)
            parts.append(f"<p>{title}</p><ul>{items}</ul>")
    return "".join(parts)
