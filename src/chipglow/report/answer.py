"""The answer: the errors in sentences, each with its interval."""

from collections.abc import Iterator, Sequence
from math import isfinite

from chipglow.analysis import Distribution
from chipglow.analysis.distribution import COVERAGE
from chipglow.analysis.reductions import Headline
from chipglow.quantities.format import quantity_text
from chipglow.report.facts import Facts, texts
from chipglow.report.page import Answer, Term
from chipglow.report.paper import PAPER
from chipglow.report.rows import MAIN, Row, draws_text, slug, spread_text

_MAX_SENTENCES = 3
"""Number of sentences; the tables hold all errors."""


def answer(facts: Facts, rows: Sequence[Row]) -> Answer:
    """Return a sentence for each main error: of a cut at fixed places, else at the first ones.

    Each refers to the explanation of its row.
    """
    links = {row.key: row.term.key for row in rows}
    found = dict(list(_main(facts))[:_MAX_SENTENCES])
    statements = [
        Term(links[f"{slug(name)}_error_degC"], name, _sentence(facts, name, one))
        for name, one in found.items()
    ]
    several = any(one.error.draws > 1 for one in found.values())
    return Answer(statements, facts.text(texts()["note"]) if several else "")


def _main(facts: Facts) -> Iterator[tuple[str, Headline]]:
    """Yield the first error at every place with every surface; of a cut its main ones."""
    places = set()
    for name, found in facts.headlines.items():
        place = (found.place, found.surface)
        if name in MAIN if facts.analysis.cut is not None else place not in places:
            places.add(place)
            yield name, found


def _sentence(facts: Facts, name: str, found: Headline) -> str:
    template = texts()["answers"].get(name, texts()["answers"]["any"])
    values = {"name": name, "surface": found.surface, "error": error_text(found.error)}
    parts = [facts.text(template, **values)]
    fraction = found.psf_fraction
    if fraction is not None and fraction.mean > 0:  # blur may raise the temperature beside a band
        percent = spread_text(100 * fraction.mean, 100 * fraction.standard_deviation, "%", 0)
        parts.append(f"the point spread function accounts for {percent} of the error")
    published = PAPER.get(f"{name}_error_degC") if facts.is_compared else None
    if published is not None and found.error.draws > 1:
        side = "outside" if found.error.differs_from(published.value) else "inside"
        parts.append(f"the paper's {-published.value:.0f} °C lies {side} the interval")
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
