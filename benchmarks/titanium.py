"""Measured orthogonal cuts of Ti-6Al-4V compared with the same cuts computed by chipglow.

    python benchmarks/titanium.py [--cell 10] [--markdown] [NAME ...]

The tests, and where they stand, are in titanium.yaml. Neither the width of cut nor the rake angle
is known: what does not depend on the width is compared, at two rake angles. A cut takes minutes;
its means are kept in build/titanium, so that an interrupted run goes on with the next cut. A NAME
is a condition, such as 212.2-0.1 (m/min, mm); cells in um.
"""

import sys
from collections import namedtuple
from itertools import pairwise
from math import isfinite, nan, radians
from pathlib import Path
from statistics import fmean
from typing import NamedTuple

import yaml
from common import arguments, minus, print_tables, spread
from experiments import CONDITIONS, FORCE, LENGTH, Means, in_si, means_of, number, quality

from chipglow import cutting
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

RAKES = (0.0, 10.0)  # degrees: no source that was read tells it
CLEARANCE = 7.0
POINTS = 3  # along a side of a cell: with two, 1.0 to 1.2 % of the work is unaccounted for
FEEDS_A_CUT = 6  # a longer chip curls down on the uncut surface


Trial = namedtuple(
    "Trial", "name speed feed cutting_force feed_force edge_radius thickness wear status"
)
"""One test of the source, in SI; its forces are those of the whole, unknown width."""


class Condition(NamedTuple):
    """Speed in m/s and feed in m of one or more tests."""

    speed: float
    feed: float

    @property
    def m_a_minute(self):
        return f"{60 * self.speed:.4g}"

    @property
    def mm(self):
        return f"{1e3 * self.feed:.3g}"

    @property
    def name(self):
        return f"{self.m_a_minute}-{self.mm}"

    def __str__(self):
        return f"{self.m_a_minute} m/min, {self.mm} mm"


Cut = namedtuple("Cut", "cutting_force thrust_force thickness")
"""Measured values: forces of an unknown width in N, thickness in m."""


def read_trials():
    data = yaml.safe_load(DATA.read_text(encoding="utf-8"))
    trials = [Trial(**in_si(entry, FIELDS)) for entry in data["tests"]]
    return " ".join(data["source"].split()), trials


def repeats(trials):
    found = {}
    for trial in sorted(trials, key=lambda one: (one.feed, one.speed)):
        found.setdefault(Condition(trial.speed, trial.feed), []).append(trial)
    return found


def mean(trials):
    names = ("cutting_force", "feed_force", "thickness")
    return Cut(*(fmean(getattr(trial, name) for trial in trials) for name in names))


def ratios(cuts):
    """Return ratios that do not depend on the width of cut, by their name.

    Thrust over cutting force and thickness over feed of every cut, and its cutting force over that
    of the next smaller feed at the same speed and of the next lower speed at the same feed.
    """
    ordered = sorted(cuts, key=lambda at: (at.feed, at.speed))
    found = {f"Ff / Fc at {at}": cuts[at].thrust_force / cuts[at].cutting_force for at in ordered}
    found |= {f"thickness / feed at {at}": cuts[at].thickness / at.feed for at in ordered}
    for low, high in pairwise(sorted(cuts)):
        if low.speed == high.speed:
            name = f"Fc({high.mm} mm) / Fc({low.mm} mm) at {low.m_a_minute} m/min"
            found[name] = cuts[high].cutting_force / cuts[low].cutting_force
    for slow, fast in pairwise(ordered):
        if slow.feed == fast.feed:
            name = f"Fc({fast.m_a_minute} m/min) / Fc({slow.m_a_minute} m/min) at {slow.mm} mm"
            found[name] = cuts[fast].cutting_force / cuts[slow].cutting_force
    return found


def simulation(trials, rake, cell):
    speed, feed = trials[0].speed, trials[0].feed
    edge_radius = fmean(trial.edge_radius for trial in trials)
    return cutting.CuttingSimulation(
        workpiece=cutting.workpiece("ti-6al-4v"),
        conditions=cutting.CuttingConditions(speed, feed, FEEDS_A_CUT * feed),
        tool=ToolGeometry(radians(rake), radians(CLEARANCE), edge_radius),
        tool_material=cutting.tool_material("carbide"),
        numerics=cutting.Numerics(cell, points_per_side=POINTS, upstream=max(0.75e-3, 4 * feed)),
    )


def measurements(tests):
    head = ["speed / (m/min)", "feed / mm", "tests", "wear", "edge radius / µm"]
    rows = [[*head, "Fc / N", "Ff / Fc", "thickness / feed"]]
    for at, trials in tests.items():
        names, wear = ", ".join(one.name for one in trials), {one.wear for one in trials}
        radius = spread([1e6 * one.edge_radius for one in trials], 1)
        force = spread([one.cutting_force for one in trials], 1)
        ratio = spread([one.feed_force / one.cutting_force for one in trials], 2)
        thickness = spread([one.thickness / one.feed for one in trials], 2)
        worn = "".join(sorted(wear))
        rows.append([at.m_a_minute, at.mm, names, worn, radius, force, ratio, thickness])
    return rows


def comparison(measured, computed):
    rows = [["quantity", "measured"]]
    for rake in computed:
        rows[0] += [f"rake {rake:g}°", "difference"]
    for quantity, there in measured.items():
        row = [quantity, f"{there:.2f}"]
        for here in (side.get(quantity, nan) for side in computed.values()):
            known = isfinite(here)
            row += [f"{here:.2f}", f"{100 * (here / there - 1):+.0f} %"] if known else ["–", "–"]
        rows.append([minus(cell) for cell in row])
    return rows


def cuts_made(outcomes, tests):
    head = ["speed / (m/min)", "feed / mm", "rake / °", "Fc / (N/mm)", "Ff / (N/mm)"]
    head += ["Fc measured / computed / mm", "segment / µm", "segments", "drift / %"]
    rows = [[*head, "unaccounted work / %", "time / s"]]
    for (at, rake), means in outcomes.items():
        row = [at.m_a_minute, at.mm, f"{rake:g}"]
        if isinstance(means, cutting.SolverError):
            rows.append([*row, str(means), *["–"] * 7])
            continue
        forces = (number(one, FORCE) for one in (means.cutting_force, means.thrust_force))
        width = f"{1e3 * mean(tests[at]).cutting_force / means.cutting_force:.2f}"
        segment = number(means.period * at.speed, SMALL_LENGTH)
        rows.append([*row, *forces, width, segment, f"{means.segments}", *quality(means)])
    return rows


def outcome_of(trials, rake, cell):
    name = f"{Condition(trials[0].speed, trials[0].feed).name}-{rake:g}"
    print(name, file=sys.stderr, flush=True)
    try:
        return means_of(simulation(trials, rake, cell), name, RESULTS)
    except cutting.SolverError as error:
        return error


def main():
    source, trials = read_trials()
    tests = repeats(trials)
    names = tuple(at.name for at in tests)
    given = arguments(__doc__, names=names, cell=10.0, markdown=False)
    tests = {at: found for at, found in tests.items() if at.name in given.names}
    outcomes = {
        (at, rake): outcome_of(found, rake, given.cell / 1e6)
        for at, found in tests.items()
        for rake in RAKES
    }
    computed = {rake: {} for rake in RAKES}
    for (at, rake), means in outcomes.items():
        if isinstance(means, Means):
            computed[rake][at] = means
    there = ratios({at: mean(found) for at, found in tests.items()})
    here = {rake: ratios(cuts) for rake, cuts in computed.items()}
    print(f"Cell {given.cell:g} um, solver {cutting.SOLVER_VERSION}. Measured: {source}")
    tables = measurements(tests), comparison(there, here), cuts_made(outcomes, tests)
    print_tables(tables, given.markdown)


if __name__ == "__main__":
    main()
