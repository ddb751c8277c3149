"""Results drawn on given and on new axes, and as a notebook shows them."""

from xml.etree import ElementTree

import numpy as np
from matplotlib import pyplot as plt


def on_given_axes(result, *arguments):
    """Return axes on which a result is drawn; it must not make others."""
    figure, axes = plt.subplots()
    open_before = plt.get_fignums()
    assert result.plot(*arguments, ax=axes) is axes
    assert plt.get_fignums() == open_before
    plt.close(figure)
    return axes


def on_new_axes(result, *arguments):
    """Return new axes on which a result is drawn."""
    open_before = plt.get_fignums()
    axes = result.plot(*arguments)
    assert plt.get_fignums() == [*open_before, axes.figure.number]
    plt.close(axes.figure)
    return axes


def in_a_notebook(result):
    """Return columns, rows and sentences of a result's HTML."""
    page = ElementTree.fromstring(f"<div>{result._repr_html_()}</div>")
    columns = [cell.text for cell in page.iterfind("table/thead/tr/th")]
    rows = [[cell.text for cell in row.iterfind("td")] for row in page.iterfind("table/tbody/tr")]
    return columns, rows, [one.text for one in page.iterfind("ul/li")]


def legend_of(axes):
    """Return the labels in the legend."""
    return [text.get_text() for text in axes.get_legend().get_texts()]


def points_of(axes, label):
    """Return x and y of the curve with a label, or of the one with its error bars."""
    handles, labels = axes.get_legend_handles_labels()
    handle = handles[labels.index(label)]
    line = handle.lines[0] if hasattr(handle, "lines") else handle
    # Matplotlib keeps some numbers of error bars as objects.
    return tuple(np.array(list(values)) for values in line.get_data())
