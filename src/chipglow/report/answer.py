"""The answer: the errors in sentences, each with its interval."""

from collections.abc import Iterator, Sequence
from itertools import islice
from math import isfinite
from typing import Final, NamedTuple

from chipglow.analysis import Distribution
from chipglow.analysis.distribution import COVERAGE
from chipglow.quantities.format import quantity_text
from chipglow.report.facts import Facts
from chipglow.report.page import texts
from chipglow.report.rows import MAIN, Row, draws_text, slug, spread_text

_MAX_SENTENCES: Final = 3
"""Number of sentences; the tables hold all errors."""


class Statement(NamedTuple):
    """A sentence on an error, and the id of its explanation on the page."""

    text: str
    link: str


def answer(facts: Facts, errors: Sequence[Row]) -> list[Statement]:
    """Return a sentence for each main error: of a cut at fixed places, else at the first ones."""
    rows = {row.key: row for row in errors}
    return [
        Statement(_sentence(facts, name, rows), rows[f"{slug(name)}_error_degC"].link)
        for name in islice(_main(facts), _MAX_SENTENCES)
    ]


def _main(facts: Facts) -> Iterator[str]:
    """Yield the first error at every place with every surface; of a cut its main ones."""
    places = set()
    for name, found in facts.headlines.items():
        place = (found.place, found.surface)
        if name in MAIN if facts.analysis.cut is not None else place not in places:
            places.add(place)
            yield name


def _sentence(facts: Facts, name: str, rows: dict[str, Row]) -> str:
    found, row = facts.headlines[name], rows[f"{slug(name)}_error_degC"]
    template = texts()["answers"].get(name, texts()["answers"]["any"])
    values = {"name": name, "surface": found.surface, "error": error_text(found.error)}
    parts = [facts.text(template, **values)]
    fraction = found.psf_fraction
    if fraction is not None and fraction.mean > 0:  # blur may raise the temperature beside a band
        percent = spread_text(100 * fraction.mean, 100 * fraction.standard_deviation, "%", 0)
        parts.append(f"the point spread function accounts for {percent} of the error")
    if row.paper is not None and found.error.draws > 1:
        side = "outside" if row.differs else "inside"
        parts.append(f"the paper's {-row.paper:.0f} °C lies {side} the interval")
    return "; ".join(parts) + "."


def error_text(error: Distribution) -> str:
    """Return how far a reading is too low or too high, with its interval."""
    scale, way = (-1.0, "low") if error.mean < 0 else (1.0, "high")
    text = f"{draws_text(error, scale)} too {way}"
    if error.draws < 2:
        return f"{text} (a single draw)"
    ends = sorted(scale * end for end in error.interval)
    if not all(map(isfinite, ends)):
        return f"{text} ({error.draws} draws)"
    low, high = (quantity_text(end, "°C", 0) for end in ends)
    unknown = ", so its sign is not known" if ends[0] < 0 < ends[1] else ""
    return f"{text} ({error.draws} draws; {COVERAGE * 100:.0f} % interval {low} to {high}{unknown})"
