"""The answer: the errors in sentences, each with its interval."""

from collections.abc import Sequence
from itertools import islice
from math import isfinite
from typing import Final, NamedTuple

from chipglow.analysis import Distribution, outside_texts
from chipglow.quantities.format import quantity_text
from chipglow.report.facts import Facts
from chipglow.report.page import texts
from chipglow.report.paper import few_text
from chipglow.report.rows import Row, draws_text, main_readings, slug, spread_text

_MAX_SENTENCES: Final = 3
"""Number of sentences; the tables hold all errors."""

_MANY: Final = 0.5
"""Fraction of saturated pixels above which the advice is on saturation."""


class Statement(NamedTuple):
    """A sentence on an error, and the id of its explanation on the page."""

    text: str
    link: str


def answer(facts: Facts, errors: Sequence[Row]) -> list[Statement]:
    """Return a sentence for each main error: of a cut at fixed places, else at the first ones.

    The last one states the error against the true temperature at the first of these places.
    """
    rows = {row.key: row for row in errors}
    names = list(islice(main_readings(facts), _MAX_SENTENCES))
    statements = [
        Statement(_sentence(facts, name, rows), rows[f"{slug(name)}_error_degC"].link)
        for name in names
    ]
    for name in names[:1]:
        link = rows[f"{slug(name)}_corrected_error_degC"].link
        statements.append(Statement(_of_true_temperature(facts, name), link))
    return statements


def _sentence(facts: Facts, name: str, rows: dict[str, Row]) -> str:
    found, row = facts.headlines[name], rows[f"{slug(name)}_error_degC"]
    template = texts()["answers"].get(name, texts()["answers"]["any"])
    values = {"name": name, "surface": found.surface, "error": error_text(found.error)}
    parts = [facts.text(template, **values)]
    fraction = found.psf_fraction if facts.analysis.cut else None
    if fraction is not None and fraction.mean > 0:  # blur may raise the temperature beside a band
        percent = spread_text(100 * fraction.mean, 100 * fraction.expanded_uncertainty, "%", 0)
        parts.append(f"the point spread function accounts for {percent} of the error")
    if row.published is not None and row.differs is not None:
        side, value = "outside" if row.differs else "within", row.published.text("K", scale=-1.0)
        parts.append(f"the paper's {value} lies {side} the interval of a single frame")
    place = facts.data.sel(reading=name)
    parts += outside_texts(float(place.below_range), float(place.saturated))
    return "; ".join(parts) + "."


def _of_true_temperature(facts: Facts, name: str) -> str:
    found = facts.headlines[name]
    emissivity = float(facts.data.set_emissivity.sel(surface=found.surface))
    return facts.text(
        texts()["answers"]["true_temperature"],
        place=found.place,
        emissivity=f"{emissivity:.2f}",
        plain=_side(found.true_error.mean),
        corrected=_side(found.corrected_error.mean),
    )


def changes(facts: Facts, errors: Sequence[Row]) -> list[str]:
    """Return a sentence for each main error: its largest part, and what would reduce it."""
    rows = {row.key: row for row in errors}
    sentences = []
    for name in islice(main_readings(facts), _MAX_SENTENCES):
        row = rows[f"{slug(name)}_error_degC"]
        if row.here is None or not row.parts:
            continue
        sign = -1 if row.here < 0 else 1
        part, draws = max(row.parts.items(), key=lambda item: sign * item[1].mean)
        if float(facts.data.saturated.sel(reading=name)) >= _MANY:
            part = "saturated"
        values = {"quantity": row.quantity, "here": row.here, "part": draws.mean}
        sentences.append(facts.text(texts()["changes"][part], **values))
    return sentences


def error_text(error: Distribution) -> str:
    """Return how far a reading is too low or too high on average and in a single frame."""
    scale, way, other = (-1.0, "low", "high") if error.mean < 0 else (1.0, "high", "low")
    text = f"{draws_text(error, scale)} too {way}"
    low, high = sorted(scale * end for end in error.interval)
    if not isfinite(low):
        few = few_text(error)
        return f"{text} (no interval: {few[0].lower()}{few[1:]})"
    least = quantity_text(abs(low), "K", 0) + (f" too {other}" if low < 0 else "")
    most = f"{quantity_text(high, 'K', 0)} too {way}"
    return f"{text} on average; in a single frame between {least} and {most}"


def _side(error: float) -> str:
    return f"{quantity_text(abs(error), 'K', 0)} too {'low' if error < 0 else 'high'}"
