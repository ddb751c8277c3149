"""Measured orthogonal cuts of Ti-6Al-4V beside the same cuts computed here.

    python benchmarks/titanium.py [--cell 10] [--markdown] [NAME ...]

The tests, and where they stand, are in titanium.yaml. Neither the width of cut nor the rake angle
is known: what does not depend on the width is compared, at two rake angles. A cut takes minutes;
its means are kept in build/titanium, so that an interrupted run goes on with the next cut. A NAME
is a condition, such as 212.2-0.1 (m/min, mm); cells in um.
"""

import argparse
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite, nan, radians
from pathlib import Path
from statistics import fmean, stdev
from typing import Any, NamedTuple

import yaml
from experiments import CONDITIONS, FORCE, LENGTH, Means, aligned, markdown, means_of, number

from chipglow.cutting import (
    SOLVER_VERSION,
    CuttingConditions,
    CuttingSimulation,
    Numerics,
    SolverError,
    tool_material,
    workpiece,
)
from chipglow.quantities.units import Quantity
from chipglow.scene import ToolGeometry

DATA = Path(__file__).with_name("titanium.yaml")
RESULTS = Path("build/titanium")

WHOLE_FORCE = Quantity("a force", "N", "N", "195 N")
SMALL_LENGTH = Quantity("a length", "m", "um", "31 um")
FIELDS = {
    "speed": CONDITIONS["speed"],
    "feed": LENGTH,
    "cutting_force": WHOLE_FORCE,
    "feed_force": WHOLE_FORCE,
    "edge_radius": SMALL_LENGTH,
    "thickness": SMALL_LENGTH,
}
ALLOWED = {"wear": ("L", "M"), "status": ("ok", "short")}

RAKES = (0.0, 10.0)  # degrees: no source that was read tells it
CLEARANCE = 7.0
POINTS = 3  # along a side of a cell: with two, 1.0 to 1.2 % of the work is unaccounted for
FEEDS_A_CUT = 6  # a longer chip curls down on the uncut surface


@dataclass(frozen=True)
class Trial:
    """One test of the source, in SI; its forces are those of the whole, unknown width."""

    name: str
    speed: float
    feed: float
    cutting_force: float
    feed_force: float
    edge_radius: float
    thickness: float
    wear: str
    status: str

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> "Trial":
        for key, allowed in ALLOWED.items():
            if data.get(key) not in allowed:
                raise ValueError(f"{key} {data.get(key)!r}, expected one of {', '.join(allowed)}")
        return cls(**{**data, **{name: unit.parse(data[name]) for name, unit in FIELDS.items()}})


class Condition(NamedTuple):
    """Speed in m/s and feed in m of one or more tests."""

    speed: float
    feed: float

    @property
    def name(self) -> str:
        return f"{_m_a_minute(self.speed)}-{_mm(self.feed)}"


class Cut(NamedTuple):
    """What is compared, measured or computed: forces of any one width, thickness in m."""

    cutting_force: float
    thrust_force: float
    thickness: float


def read_trials(path: Path = DATA) -> tuple[str, list[Trial]]:
    """The source of the tests, and the tests, checked.

    Raises
    ------
    ValueError
        If an entry breaks the form of the file; the message names file and test.
    """
    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    trials = []
    for entry in data["tests"]:
        try:
            trials.append(Trial.of(entry))
        except (KeyError, TypeError, ValueError) as error:
            name = entry.get("name", "a test without a name")
            raise ValueError(f"{path.name}: {name}: {error}") from None
    return " ".join(data["source"].split()), trials


def repeats(trials: Iterable[Trial]) -> dict[Condition, list[Trial]]:
    """The tests by condition, from the least feed and speed on."""
    found: dict[Condition, list[Trial]] = {}
    for trial in sorted(trials, key=lambda one: (one.feed, one.speed)):
        found.setdefault(Condition(trial.speed, trial.feed), []).append(trial)
    return found


def mean(trials: list[Trial]) -> Cut:
    """Mean of the repeats."""
    return Cut(
        fmean(trial.cutting_force for trial in trials),
        fmean(trial.feed_force for trial in trials),
        fmean(trial.thickness for trial in trials),
    )


def ratios(cuts: Mapping[Condition, Cut]) -> dict[str, float]:
    """What does not depend on the width of cut, by what it is.

    Thrust over cutting force and thickness over feed of every cut, and its cutting force over that
    of the next smaller feed at the same speed and of the next lower speed at the same feed.
    """
    found = {}
    ordered = sorted(cuts, key=lambda at: (at.feed, at.speed))
    for at in ordered:
        found[f"Ff / Fc at {_at(at)}"] = cuts[at].thrust_force / cuts[at].cutting_force
    for at in ordered:
        found[f"thickness / feed at {_at(at)}"] = cuts[at].thickness / at.feed
    for low, high in pairwise(sorted(cuts)):
        if low.speed == high.speed:
            what = f"Fc({_mm(high.feed)} mm) / Fc({_mm(low.feed)} mm)"
            change = cuts[high].cutting_force / cuts[low].cutting_force
            found[f"{what} at {_m_a_minute(low.speed)} m/min"] = change
    for slow, fast in pairwise(ordered):
        if slow.feed == fast.feed:
            what = f"Fc({_m_a_minute(fast.speed)} m/min) / Fc({_m_a_minute(slow.speed)} m/min)"
            change = cuts[fast].cutting_force / cuts[slow].cutting_force
            found[f"{what} at {_mm(slow.feed)} mm"] = change
    return found


def simulation(trials: list[Trial], rake: float, cell: float) -> CuttingSimulation:
    """The cut of the tests; materials are the library's, friction the solver's own."""
    speed, feed = trials[0].speed, trials[0].feed
    edge_radius = fmean(trial.edge_radius for trial in trials)
    return CuttingSimulation(
        workpiece=workpiece("ti-6al-4v"),
        conditions=CuttingConditions(speed, feed, FEEDS_A_CUT * feed),
        tool=ToolGeometry(radians(rake), radians(CLEARANCE), edge_radius),
        tool_material=tool_material("carbide"),
        numerics=Numerics(cell, points_per_side=POINTS, upstream=max(0.75e-3, 4 * feed)),
    )


def measurements(tests: Mapping[Condition, list[Trial]]) -> list[list[str]]:
    """Rows of the table of what was measured, its head first."""
    head = ["speed / (m/min)", "feed / mm", "tests", "wear", "edge radius / µm"]
    rows = [[*head, "Fc / N", "Ff / Fc", "thickness / feed"]]
    for at, trials in tests.items():
        rows.append(
            [
                _m_a_minute(at.speed),
                _mm(at.feed),
                ", ".join(trial.name for trial in trials),
                "".join(sorted({trial.wear for trial in trials})),
                spread([1e6 * trial.edge_radius for trial in trials], 1),
                spread([trial.cutting_force for trial in trials], 1),
                spread([trial.feed_force / trial.cutting_force for trial in trials], 2),
                spread([trial.thickness / trial.feed for trial in trials], 2),
            ]
        )
    return rows


def spread(values: list[float], decimals: int) -> str:
    """Mean, and the standard deviation where there are repeats."""
    deviation = f" ± {stdev(values):.{decimals}f}" if len(values) > 1 else ""
    return f"{fmean(values):.{decimals}f}{deviation}"


def comparison(
    measured: Mapping[str, float], computed: Mapping[float, Mapping[str, float]]
) -> list[list[str]]:
    """Rows of the table of measured ratios beside those computed at each rake angle, head first."""
    rows = [["quantity", "measured"]]
    for rake in computed:
        rows[0] += [f"rake {rake:g}°", "difference"]
    for quantity, there in measured.items():
        row = [quantity, f"{there:.2f}"]
        for here in (side.get(quantity, nan) for side in computed.values()):
            known = isfinite(here)
            row += [f"{here:.2f}", f"{100 * (here / there - 1):+.0f} %"] if known else ["–", "–"]
        rows.append([cell.replace("-", "−") for cell in row])
    return rows


def cuts_made(
    outcomes: Mapping[tuple[Condition, float], Means | SolverError],
    tests: Mapping[Condition, list[Trial]],
) -> list[list[str]]:
    """Rows of the table of how each cut went, its head first."""
    head = ["speed / (m/min)", "feed / mm", "rake / °", "Fc / (N/mm)", "Ff / (N/mm)"]
    head += ["Fc measured / computed / mm", "segment / µm", "segments", "drift / %"]
    rows = [[*head, "unaccounted work / %", "time / s"]]
    for (at, rake), means in outcomes.items():
        row = [_m_a_minute(at.speed), _mm(at.feed), f"{rake:g}"]
        if isinstance(means, SolverError):
            rows.append([*row, str(means), *["–"] * 7])
            continue
        width = mean(tests[at]).cutting_force / means.cutting_force
        row += [
            number(means.cutting_force, FORCE),
            number(means.thrust_force, FORCE),
            f"{1e3 * width:.2f}",
            number(means.period * at.speed, SMALL_LENGTH),
            f"{means.segments}",
            f"{100 * means.drift:+.0f}",
            f"{100 * means.unaccounted:.1f}",
            f"{means.seconds:.0f}",
        ]
        rows.append([cell.replace("-", "−") for cell in row])
    return rows


def outcome_of(trials: list[Trial], rake: float, cell: float) -> Means | SolverError:
    """Means of the cut, kept or computed now, or what stopped it."""
    cut = simulation(trials, rake, cell)
    name = f"{Condition(trials[0].speed, trials[0].feed).name}-{rake:g}"
    print(name, file=sys.stderr, flush=True)
    try:
        return means_of(cut, name, RESULTS)
    except SolverError as error:
        return error


def computed_ratios(
    outcomes: Mapping[tuple[Condition, float], Means | SolverError],
) -> dict[float, dict[str, float]]:
    """What `ratios` says of the cuts that came to their end, by rake angle."""
    return {
        rake: ratios(
            {
                at: Cut(means.cutting_force, means.thrust_force, means.thickness)
                for (at, other), means in outcomes.items()
                if other == rake and isinstance(means, Means)
            }
        )
        for rake in RAKES
    }


def _at(condition: Condition) -> str:
    return f"{_m_a_minute(condition.speed)} m/min, {_mm(condition.feed)} mm"


def _m_a_minute(speed: float) -> str:
    return f"{60 * speed:.4g}"


def _mm(length: float) -> str:
    return f"{1e3 * length:.3g}"


def arguments(names: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}")
    parser.add_argument("--cell", type=float, default=10.0, help="side of a cell in um")
    parser.add_argument("--markdown", action="store_true", help="print Markdown tables")
    given = parser.parse_args()
    if unknown := sorted(set(given.names) - set(names)):
        parser.error(f"no condition {unknown[0]!r}, expected some of {', '.join(names)}")
    return given


def main() -> None:
    source, trials = read_trials()
    tests = repeats(trials)
    given = arguments([at.name for at in tests])
    tests = {at: found for at, found in tests.items() if at.name in given.names or not given.names}
    outcomes = {
        (at, rake): outcome_of(found, rake, given.cell / 1e6)
        for at, found in tests.items()
        for rake in RAKES
    }
    there = ratios({at: mean(found) for at, found in tests.items()})
    table = markdown if given.markdown else aligned
    print(f"Cell {given.cell:g} um, solver {SOLVER_VERSION}. Measured: {source}")
    for rows in (
        measurements(tests),
        comparison(there, computed_ratios(outcomes)),
        cuts_made(outcomes, tests),
    ):
        print(f"\n{table(rows)}")


if __name__ == "__main__":
    main()
