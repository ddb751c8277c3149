"""Published cuts of AISI 1045 compared with the same cuts computed by chipglow.

    python benchmarks/experiments.py [--cell 20] [--length 2] [--figure F] [--markdown] [NAME ...]

The cuts, what is published of them and where it stands are in experiments.yaml. Each cut takes
minutes at a cell of 20 um; its means are kept in build/experiments, so that an interrupted run goes
on with the next cut. Cells in um, lengths of cut in mm.
"""

import json
import sys
from collections import namedtuple
from dataclasses import dataclass
from hashlib import sha256
from inspect import getmodule, getsource
from math import isfinite
from pathlib import Path

import numpy as np
import yaml
from common import arguments, minus, print_tables, timed

from chipglow import cutting
from chipglow.chip import chip_metrics, contact_length, segmentation
from chipglow.cutting import SOLVER_VERSION
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import GREY
from chipglow.io import atomic_path
from chipglow.quantities.units import Quantity
from chipglow.scene import FIELD_UNITS, Raster, Scene, ToolGeometry
from chipglow.scene.scene import FORCE_UNITS

DATA = Path(__file__).with_name("experiments.yaml")
RESULTS = Path("build/experiments")

LENGTH = Quantity("a length", "m", "mm", "0.3 mm")
ANGLE = Quantity("an angle", "rad", "deg", "-7 deg", positive=False)
CONDITIONS = {
    "speed": Quantity("a speed", "m/s", "m/min", "250 m/min"),
    "feed": LENGTH,
    "rake": ANGLE,
    "clearance": ANGLE,
    "edge_radius": LENGTH,
}
FORCE = Quantity("a force per width of cut", "N/m", "N/mm", "300 N/mm")
QUANTITIES = {
    "cutting_force": FORCE,
    "thrust_force": FORCE,
    "thickness": LENGTH,
    "contact": LENGTH,
    "period": Quantity("a time", "s", "us", "90 us"),
}

STEP = 10e-6  # of cut between two records of the forces
STEPS_A_FRAME = 2
BUILD_UP = 0.4  # fraction of the cut before the frames
SAMPLE = 4e-6
NOT_READ = "†"
METRICS = (chip_metrics, contact_length, segmentation)


Published = namedtuple("Published", "quantity value kind source read note", defaults=("",))
"""A published number: a key of `QUANTITIES`, its value in SI and its source."""


@dataclass(frozen=True)
class Experiment:
    """A published cut: its conditions in SI, their source, and the published numbers."""

    name: str
    source: str
    read: bool
    speed: float
    feed: float
    rake: float
    clearance: float
    edge_radius: float
    tool: str
    tool_material: str
    assumed: tuple[str, ...]
    published: tuple

    def simulation(self, cell, length):
        return cutting.CuttingSimulation(
            conditions=cutting.CuttingConditions(self.speed, self.feed, length),
            tool=ToolGeometry(self.rake, self.clearance, self.edge_radius),
            tool_material=cutting.tool_material(self.tool_material),
            # A chip four times as thick as the feed has room; the default holds the paper's chip.
            numerics=cutting.Numerics(cell, upstream=max(0.75e-3, 4 * self.feed)),
        )


Means = namedtuple(
    "Means",
    "cutting_force thrust_force thickness contact period segments degree drift unaccounted seconds",
)
"""Computed values in SI: forces per width of cut, NaN where the view shows none."""


def in_si(data, units):
    return {**data, **{name: unit.parse(data[name]) for name, unit in units.items()}}


def read_experiments():
    data = yaml.safe_load(DATA.read_text(encoding="utf-8"))
    found = []
    for entry in data["experiments"]:
        published = [
            Published(**in_si(one, {"value": QUANTITIES[one["quantity"]]}))
            for one in entry["published"]
        ]
        changed = {"assumed": tuple(entry["assumed"]), "published": tuple(published)}
        found.append(Experiment(**{**in_si(entry, CONDITIONS), **changed}))
    return {key: " ".join(text.split()) for key, text in data["sources"].items()}, found


def view(simulation):
    """Return a raster over the chip, from the rake face to the left border."""
    numerics = simulation.numerics
    left, top = -(numerics.upstream - 2 * numerics.cell), numerics.height - 4 * numerics.cell
    return Raster(left, top, SAMPLE, int((top + 1e-4) / SAMPLE), int((1.5e-4 - left) / SAMPLE))


def compute(simulation):
    """Run a cut and return its means after the chip's build-up."""
    conditions, raster, frames = simulation.conditions, view(simulation), []
    length = conditions.cutting_length
    window = cutting.OutputWindow(BUILD_UP * length, length, STEP / conditions.speed, later_bands=0)
    history, seconds, _ = timed(lambda: simulation.run(window, raster, frames.append))
    frames = frames[::STEPS_A_FRAME]
    fields = {name: np.stack([getattr(frame, name) for frame in frames]) for name in FIELD_UNITS}
    scene = Scene.from_fields(raster, [one.time for one in frames], fields, simulation.tool)
    values = history.cutting, history.thrust, history.thickness
    forces = {
        name: ("force_time", each, {"units": unit})
        for (name, unit), each in zip(FORCE_UNITS.items(), values, strict=True)
    }
    time = ("force_time", history.time, {"units": "s"})
    scene = Scene(scene.data.assign_coords(force_time=time).assign(forces))
    chip, unaccounted = chip_metrics(scene, conditions.feed), history.energy.closing_error[-1]
    names = ("cutting_mean", "thrust_mean", "thickness", "contact", "period", "segments", "degree")
    seen = (getattr(chip, name) for name in names)
    return Means(*seen, drift(history), float(unaccounted), seconds)


def drift(history):
    steady = history.time > BUILD_UP * history.time[-1] * (1 + 1e-9)
    first, second = np.array_split(history.cutting[steady], 2)
    return float(second.mean() / first.mean() - 1)


def means_of(simulation, name, folder=RESULTS):
    """Return stored means of a cut, or run it and store them, by solver, metrics and conditions."""
    metrics = [getsource(getmodule(metric)) for metric in METRICS]
    state = repr((SOLVER_VERSION, metrics, STEP, STEPS_A_FRAME, BUILD_UP, SAMPLE, simulation))
    path = folder / f"{name}-{sha256(state.encode()).hexdigest()[:16]}.json"
    if path.exists():
        return Means(**json.loads(path.read_text(encoding="utf-8")))
    means = compute(simulation)
    folder.mkdir(parents=True, exist_ok=True)
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(means._asdict(), indent=1), encoding="utf-8")
    return means


def comparison(computed):
    rows = [["cut", "quantity", "published", "kind", "source", "computed", "difference"]]
    for experiment, means in computed:
        for quantity, unit in QUANTITIES.items():
            here = getattr(means, quantity)
            label = f"{quantity.replace('_', ' ')} / {'(N/mm)' if unit is FORCE else unit.unit}"
            known = [entry for entry in experiment.published if entry.quantity == quantity]
            for entry in known or [None]:
                there, difference = ["–", "–", "–"], "–"
                if entry:
                    value = number(entry.value, unit) + mark(entry.read)
                    there = [value, entry.kind, entry.source]
                if entry and isfinite(here):
                    difference = minus(f"{100 * (here / entry.value - 1):+.0f} %")
                rows.append([experiment.name, label, *there, number(here, unit), difference])
    return rows


def cuts(computed):
    head = ["cut", "speed / (m/min)", "feed / mm", "rake / °", "conditions from", "assumed"]
    rows = [[*head, "segments", "degree / %", "drift / %", "unaccounted work / %", "time / s"]]
    for one, means in computed:
        conditions = (
            number(getattr(one, name), CONDITIONS[name]) for name in ("speed", "feed", "rake")
        )
        assumed = ", ".join(one.assumed) or "–"
        degree = f"{100 * means.degree:.0f}"
        row = [one.name, *conditions, one.source + mark(one.read), assumed, f"{means.segments}"]
        rows.append([*row, degree, *quality(means)])
    return rows


def quality(means):
    drift, lost = minus(f"{100 * means.drift:+.0f}"), minus(f"{100 * means.unaccounted:.1f}")
    return drift, lost, f"{means.seconds:.0f}"


@style()
def draw_residuals(computed, path):
    """Draw the relative difference of computed from published forces; write the figure."""
    figure = new_figure(4.5)
    axes = figure.subplots()
    entries = [(one, means, entry) for one, means in computed for entry in one.published]
    for quantity, marker in (("cutting_force", "o"), ("thrust_force", "s")):
        rows = [
            (
                f"{one.name}, {entry.source.partition('-')[0]}",
                getattr(means, quantity) / entry.value,
            )
            for one, means, entry in entries
            if entry.quantity == quantity
        ]
        names, ratios = zip(*rows, strict=True)
        excess = 100 * (np.array(ratios) - 1)
        axes.plot(excess, names, marker, label=quantity.replace("_", " "))
    axes.axvline(0.0, color=GREY, linewidth=0.8)
    axes.invert_yaxis()
    axes.set_xlabel("computed over published force, less one / %")
    axes.legend()
    figure.savefig(path, format="png")


def number(value, unit):
    """Return three digits in the quantity's unit; a dash for NaN."""
    if not isfinite(value):
        return "–"
    scaled = value / unit.parse(f"1 {unit.unit}")
    return minus(f"{scaled:.0f}" if abs(scaled) >= 100 else f"{scaled:.3g}")


def mark(read):
    return "" if read else f" {NOT_READ}"


def main():
    sources, known = read_experiments()
    names = tuple(one.name for one in known)
    given = arguments(__doc__, names=names, cell=20.0, length=2.0, figure=Path, markdown=False)
    computed = []
    for one in known:
        if one.name in given.names:
            print(one.name, file=sys.stderr, flush=True)
            simulation = one.simulation(given.cell * 1e-6, given.length * 1e-3)
            computed.append((one, means_of(simulation, one.name)))
    if given.figure:
        draw_residuals(computed, given.figure)
    print(f"Cell {given.cell:g} um, cutting length {given.length:g} mm, solver {SOLVER_VERSION}.")
    print(f"{NOT_READ}: the source was not read, look the number up before you quote it.")
    print_tables((comparison(computed), cuts(computed)), given.markdown)
    used = {key for one, _ in computed for key in (one.source, *(p.source for p in one.published))}
    for key in sorted(used):
        print(f"\n- **{key}**: {sources[key]}" if given.markdown else f"\n{key}: {sources[key]}")


if __name__ == "__main__":
    main()
