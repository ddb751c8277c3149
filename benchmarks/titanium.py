"""Measured orthogonal cuts of Ti-6Al-4V compared with the same cuts computed by chipglow.

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
from experiments import (
    CONDITIONS,
    FORCE,
    LENGTH,
    Means,
    aligned,
    check_choices,
    markdown,
    means_of,
    number,
    parsed,
    read_entries,
)

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
        check_choices(data, ALLOWED)
        return cls(**{**data, **{name: unit.parse(data[name]) for name, unit in FIELDS.items()}})


class Condition(NamedTuple):
    """Speed in m/s and feed in m of one or more tests."""

    speed: float
    feed: float

    @property
    def m_a_minute(self) -> str:
        return f"{60 * self.speed:.4g}"

    @property
    def mm(self) -> str:
        return f"{1e3 * self.feed:.3g}"

    @property
    def name(self) -> str:
        return f"{self.m_a_minute}-{self.mm}"

    def __str__(self) -> str:
        return f"{self.m_a_minute} m/min, {self.mm} mm"


class Cut(NamedTuple):
    """Measured values: forces of an unknown width in N, thickness in m."""

    cutting_force: float
    thrust_force: float
    thickness: float


def read_trials(path: Path = DATA) -> tuple[str, list[Trial]]:
    """Return the source of the tests, and the tests, checked."""
    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    return " ".join(data["source"].split()), read_entries(path, data["tests"], Trial.of)


def repeats(trials: Iterable[Trial]) -> dict[Condition, list[Trial]]:
    """Group the tests by condition, in order of feed and speed."""
    found: dict[Condition, list[Trial]] = {}
    for trial in sorted(trials, key=lambda one: (one.feed, one.speed)):
        found.setdefault(Condition(trial.speed, trial.feed), []).append(trial)
    return found


def mean(trials: list[Trial]) -> Cut:
    """Return the mean of the repeats."""
    return Cut(
        fmean(trial.cutting_force for trial in trials),
        fmean(trial.feed_force for trial in trials),
        fmean(trial.thickness for trial in trials),
    )


def ratios(cuts: Mapping[Condition, Cut | Means]) -> dict[str, float]:
    """Return ratios that do not depend on the width of cut, by their name.

    Thrust over cutting force and thickness over feed of every cut, and its cutting force over that
    of the next smaller feed at the same speed and of the next lower speed at the same feed.
    """
    ordered = sorted(cuts, key=lambda at: (at.feed, at.speed))
    forces = {f"Ff / Fc at {at}": cuts[at].thrust_force / cuts[at].cutting_force for at in ordered}
    thicknesses = {f"thickness / feed at {at}": cuts[at].thickness / at.feed for at in ordered}
    by_feed = {
        f"Fc({high.mm} mm) / Fc({low.mm} mm) at {low.m_a_minute} m/min": (
            cuts[high].cutting_force / cuts[low].cutting_force
        )
        for low, high in pairwise(sorted(cuts))
        if low.speed == high.speed
    }
    by_speed = {
        f"Fc({fast.m_a_minute} m/min) / Fc({slow.m_a_minute} m/min) at {slow.mm} mm": (
            cuts[fast].cutting_force / cuts[slow].cutting_force
        )
        for slow, fast in pairwise(ordered)
        if slow.feed == fast.feed
    }
    return {**forces, **thicknesses, **by_feed, **by_speed}


def simulation(trials: list[Trial], rake: float, cell: float) -> CuttingSimulation:
    """Return the cut of the tests with the library's materials and default friction."""
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
    """Return the table of measured values, its head first."""
    head = ["speed / (m/min)", "feed / mm", "tests", "wear", "edge radius / µm"]
    rows = [[*head, "Fc / N", "Ff / Fc", "thickness / feed"]]
    for at, trials in tests.items():
        rows.append(
            [
                at.m_a_minute,
                at.mm,
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
    """Return the mean, with the standard deviation of repeats."""
    deviation = f" ± {stdev(values):.{decimals}f}" if len(values) > 1 else ""
    return f"{fmean(values):.{decimals}f}{deviation}"


def comparison(
    measured: Mapping[str, float], computed: Mapping[float, Mapping[str, float]]
) -> list[list[str]]:
    """Return the table of measured ratios and those computed at each rake angle, head first."""
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
    """Return the table of the quality of each cut, its head first."""
    head = ["speed / (m/min)", "feed / mm", "rake / °", "Fc / (N/mm)", "Ff / (N/mm)"]
    head += ["Fc measured / computed / mm", "segment / µm", "segments", "drift / %"]
    rows = [[*head, "unaccounted work / %", "time / s"]]
    for (at, rake), means in outcomes.items():
        row = [at.m_a_minute, at.mm, f"{rake:g}"]
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
    """Return the means of the cut, stored or computed, or the error that stopped it."""
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
    """Return the ratios of completed cuts by rake angle."""
    return {
        rake: ratios(
            {
                at: means
                for (at, other), means in outcomes.items()
                if other == rake and isinstance(means, Means)
            }
        )
        for rake in RAKES
    }


def main() -> None:
    source, trials = read_trials()
    tests = repeats(trials)
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    given = parsed(parser, [at.name for at in tests], 10.0)
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
