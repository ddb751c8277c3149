"""Published cuts of AISI 1045 compared with the same cuts computed by chipglow.

    python benchmarks/experiments.py [--cell 20] [--length 2] [--figure F] [--markdown] [NAME ...]

The cuts, what is published of them and where it stands are in experiments.yaml. Each cut takes
minutes at a cell of 20 um; its means are kept in build/experiments, so that an interrupted run goes
on with the next cut. Cells in um, lengths of cut in mm.
"""

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from hashlib import sha256
from inspect import getmodule, getsource
from math import isfinite
from pathlib import Path
from time import perf_counter
from typing import Any, TypeVar

import numpy as np
import yaml

from chipglow.cutting import (
    SOLVER_VERSION,
    CuttingConditions,
    CuttingSimulation,
    ForceHistory,
    Numerics,
    OutputWindow,
    tool_material,
)
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import BLUE, GREY, VERMILLION
from chipglow.io import atomic_path
from chipglow.laboratory.chip import ChipMetrics, chip_metrics, contact_length, segmentation
from chipglow.quantities.units import Quantity
from chipglow.scene import FIELD_UNITS, Frame, Raster, Scene, ToolGeometry
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
KINDS = ("measured", "correlation", "computed")

STEP = 10e-6  # of cut between two records of the forces
STEPS_A_FRAME = 2
BUILD_UP = 0.4  # fraction of the cut before the frames
SAMPLE = 4e-6
NOT_READ = "†"
Entry = TypeVar("Entry")
METRICS = (chip_metrics, contact_length, segmentation)


@dataclass(frozen=True)
class Published:
    """A published number: a key of `QUANTITIES`, its value in SI and its source."""

    quantity: str
    value: float
    kind: str
    source: str
    read: bool
    note: str = ""

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> "Published":
        check_choices(data, {"quantity": tuple(QUANTITIES), "kind": KINDS})
        return cls(**{**data, "value": QUANTITIES[data["quantity"]].parse(data["value"])})


def check_choices(data: Mapping[str, Any], choices: Mapping[str, tuple[str, ...]]) -> None:
    """Raise a ValueError if an entry is not one of its choices."""
    for key, allowed in choices.items():
        if data.get(key) not in allowed:
            raise ValueError(f"{key} {data.get(key)!r}, expected one of {', '.join(allowed)}")


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
    published: tuple[Published, ...]

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> "Experiment":
        conditions = {name: unit.parse(data[name]) for name, unit in CONDITIONS.items()}
        published = tuple(Published.of(entry) for entry in data["published"])
        return cls(
            **{**data, **conditions, "assumed": tuple(data["assumed"]), "published": published}
        )

    def simulation(self, cell: float, length: float) -> CuttingSimulation:
        """Return the cut at these conditions with the default material, friction and numerics."""
        return CuttingSimulation(
            conditions=CuttingConditions(self.speed, self.feed, length),
            tool=ToolGeometry(self.rake, self.clearance, self.edge_radius),
            tool_material=tool_material(self.tool_material),
            # A chip four times as thick as the feed has room; the default holds the paper's chip.
            numerics=Numerics(cell, upstream=max(0.75e-3, 4 * self.feed)),
        )


@dataclass(frozen=True)
class Means:
    """Computed values in SI: forces per width of cut, NaN where the view shows none."""

    cutting_force: float
    thrust_force: float
    thickness: float
    contact: float
    period: float
    segments: int
    degree: float
    drift: float
    unaccounted: float
    seconds: float


def read_experiments(path: Path = DATA) -> tuple[dict[str, str], list[Experiment]]:
    """Return sources by their key, and the experiments, checked."""
    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    sources = {key: " ".join(text.split()) for key, text in data["sources"].items()}

    def experiment(entry: Mapping[str, Any]) -> Experiment:
        found = Experiment.of(entry)
        for source in (found.source, *(value.source for value in found.published)):
            if source not in sources:
                raise ValueError(f"source {source!r}, expected one of {list(sources)}")
        return found

    return sources, read_entries(path, data["experiments"], experiment)


def read_entries(
    path: Path, entries: Iterable[Mapping[str, Any]], build: Callable[[Mapping[str, Any]], Entry]
) -> list[Entry]:
    """Build entries of a file; a ValueError names file and entry."""
    found = []
    for entry in entries:
        try:
            found.append(build(entry))
        except (KeyError, TypeError, ValueError) as error:
            name = entry.get("name", "an entry without a name")
            raise ValueError(f"{path.name}: {name}: {error}") from None
    return found


def view(simulation: CuttingSimulation) -> Raster:
    """Return a raster over the chip, from the rake face to the left border."""
    numerics = simulation.numerics
    left, top = -(numerics.upstream - 2 * numerics.cell), numerics.height - 4 * numerics.cell
    return Raster(left, top, SAMPLE, int((top + 1e-4) / SAMPLE), int((1.5e-4 - left) / SAMPLE))


def compute(simulation: CuttingSimulation) -> Means:
    """Run a cut and return its means after the chip's build-up."""
    length = simulation.conditions.cutting_length
    window = OutputWindow(
        BUILD_UP * length, length, STEP / simulation.conditions.speed, later_bands=0
    )
    chip, history, seconds = cut(simulation, window)
    return Means(
        cutting_force=chip.cutting_mean,
        thrust_force=chip.thrust_mean,
        thickness=chip.thickness,
        contact=chip.contact,
        period=chip.period,
        segments=chip.segments,
        degree=chip.degree,
        drift=drift(history),
        unaccounted=float(history.energy.closing_error[-1]),
        seconds=seconds,
    )


def cut(
    simulation: CuttingSimulation, window: OutputWindow
) -> tuple[ChipMetrics, ForceHistory, float]:
    """Run a cut; return its chip, its forces and the time in s."""
    frames: list[Frame] = []
    passed = iter(range(1_000_000))

    def keep(frame: Frame) -> None:
        if next(passed) % STEPS_A_FRAME == 0:
            frames.append(frame)

    raster, start = view(simulation), perf_counter()
    history = simulation.run(window, raster, keep)
    seconds = perf_counter() - start
    scene = scene_of(frames, history, raster, simulation.tool)
    return chip_metrics(scene, simulation.conditions.feed), history, seconds


def scene_of(
    frames: list[Frame], history: ForceHistory, raster: Raster, tool: ToolGeometry
) -> Scene:
    """Return frames and forces as a scene."""
    fields = {name: np.stack([getattr(frame, name) for frame in frames]) for name in FIELD_UNITS}
    scene = Scene.from_fields(raster, [frame.time for frame in frames], fields, tool)
    values = history.cutting, history.thrust, history.thickness
    known = zip(FORCE_UNITS.items(), values, strict=True)
    return Scene(
        scene.data.assign_coords(force_time=("force_time", history.time, {"units": "s"})).assign(
            {name: ("force_time", each, {"units": unit}) for (name, unit), each in known}
        )
    )


def drift(history: ForceHistory) -> float:
    """Return the relative change of the mean cutting force between halves after the build-up."""
    steady = history.time > BUILD_UP * history.time[-1] * (1 + 1e-9)
    first, second = np.array_split(history.cutting[steady], 2)
    return float(second.mean() / first.mean() - 1)


def result_path(simulation: CuttingSimulation, name: str, folder: Path = RESULTS) -> Path:
    """Return the file of a cut's means, named by solver, metrics and conditions."""
    metrics = [getsource(getmodule(metric)) for metric in METRICS]
    state = repr((SOLVER_VERSION, metrics, STEP, STEPS_A_FRAME, BUILD_UP, SAMPLE, simulation))
    return folder / f"{name}-{sha256(state.encode()).hexdigest()[:16]}.json"


def means_of(simulation: CuttingSimulation, name: str, folder: Path = RESULTS) -> Means:
    """Return stored means of a cut, or run it and store them."""
    path = result_path(simulation, name, folder)
    if path.exists():
        return Means(**json.loads(path.read_text(encoding="utf-8")))
    means = compute(simulation)
    folder.mkdir(parents=True, exist_ok=True)
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(asdict(means), indent=1), encoding="utf-8")
    return means


def comparison(computed: Iterable[tuple[Experiment, Means]]) -> list[list[str]]:
    """Return the table of published and computed numbers, its head first."""
    head = ["cut", "quantity", "published", "kind", "source", "computed", "difference"]
    rows = [head]
    for experiment, means in computed:
        for quantity, unit in QUANTITIES.items():
            here = getattr(means, quantity)
            known = [entry for entry in experiment.published if entry.quantity == quantity]
            label = f"{quantity.replace('_', ' ')} / {'(N/mm)' if unit is FORCE else unit.unit}"
            for entry in known or [None]:
                rows.append([experiment.name, label, *_sides(entry, here, unit)])
    return rows


def _sides(entry: Published | None, here: float, unit: Quantity) -> list[str]:
    there = (
        [number(entry.value, unit) + mark(entry.read), entry.kind, entry.source] if entry else []
    )
    difference = f"{100 * (here / entry.value - 1):+.0f} %" if entry and isfinite(here) else "–"
    return [*(there or ["–", "–", "–"]), number(here, unit), difference.replace("-", "−")]


def cuts(computed: Iterable[tuple[Experiment, Means]]) -> list[list[str]]:
    """Return the table of conditions and quality of each cut, its head first."""
    head = ["cut", "speed / (m/min)", "feed / mm", "rake / °", "conditions from", "assumed"]
    rows = [[*head, "segments", "degree / %", "drift / %", "unaccounted work / %", "time / s"]]
    for experiment, means in computed:
        numbers = [
            number(getattr(experiment, name), CONDITIONS[name]) for name in list(CONDITIONS)[:3]
        ]
        rows.append(
            [
                experiment.name,
                *numbers,
                experiment.source + mark(experiment.read),
                ", ".join(experiment.assumed) or "–",
                f"{means.segments}",
                f"{100 * means.degree:.0f}",
                f"{100 * means.drift:+.0f}".replace("-", "−"),
                f"{100 * means.unaccounted:.1f}".replace("-", "−"),
                f"{means.seconds:.0f}",
            ]
        )
    return rows


@style()
def draw_residuals(computed: Iterable[tuple[Experiment, Means]], path: Path) -> None:
    """Draw the relative difference of computed from published forces; write the figure."""
    rows = [
        (f"{one.name}, {entry.source.partition('-')[0]}", entry, getattr(means, entry.quantity))
        for one, means in computed
        for entry in one.published
        if QUANTITIES[entry.quantity] is FORCE
    ]
    names = list(dict.fromkeys(name for name, _, _ in rows))
    figure = new_figure(0.8 + 0.27 * len(names))
    axes = figure.subplots()
    for quantity, marker in (("cutting_force", "o"), ("thrust_force", "s")):
        chosen = [row for row in rows if row[1].quantity == quantity]
        residuals = [100 * (here / entry.value - 1) for _, entry, here in chosen]
        places = [names.index(name) for name, _, _ in chosen]
        colour = BLUE if marker == "o" else VERMILLION
        axes.plot(residuals, places, marker, color=colour, label=quantity.replace("_", " "))
    axes.axvline(0.0, color=GREY, linewidth=0.8)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlabel("computed over published force, less one / %")
    axes.legend()
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="png")


def number(value: float, unit: Quantity) -> str:
    """Return three digits in the quantity's unit; a dash for NaN."""
    if not isfinite(value):
        return "–"
    scaled = value / unit.parse(f"1 {unit.unit}")
    digits = f"{scaled:.0f}" if abs(scaled) >= 100 else f"{scaled:.3g}"
    return digits.replace("-", "−")


def mark(read: bool) -> str:
    return "" if read else f" {NOT_READ}"


def markdown(rows: list[list[str]]) -> str:
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([lines[0], "|---" * len(rows[0]) + "|", *lines[1:]])


def aligned(rows: list[list[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    padded = ([cell.ljust(width) for cell, width in zip(row, widths, strict=True)] for row in rows)
    return "\n".join("  ".join(row).rstrip() for row in padded)


def parsed(parser: argparse.ArgumentParser, names: list[str], cell: float) -> argparse.Namespace:
    """Parse the arguments that the programs of published cuts share, and the parser's own."""
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}")
    parser.add_argument("--cell", type=float, default=cell, help="side of a cell in um")
    parser.add_argument("--markdown", action="store_true", help="print Markdown tables")
    given = parser.parse_args()
    if unknown := sorted(set(given.names) - set(names)):
        parser.error(f"no cut {unknown[0]!r}, expected some of {', '.join(names)}")
    return given


def main() -> None:
    sources, experiments = read_experiments()
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--length", type=float, default=2.0, help="cutting length in mm")
    parser.add_argument("--figure", type=Path, help="draw the residuals of the forces, a PNG file")
    given = parsed(parser, [experiment.name for experiment in experiments], 20.0)
    computed = []
    for experiment in experiments:
        if given.names and experiment.name not in given.names:
            continue
        print(experiment.name, file=sys.stderr, flush=True)
        simulation = experiment.simulation(given.cell * 1e-6, given.length * 1e-3)
        computed.append((experiment, means_of(simulation, experiment.name)))
    if given.figure:
        draw_residuals(computed, given.figure)
    table = markdown if given.markdown else aligned
    print(f"Cell {given.cell:g} um, cutting length {given.length:g} mm, solver {SOLVER_VERSION}.")
    print(f"{NOT_READ}: the source was not read, look the number up before you quote it.")
    for rows in (comparison(computed), cuts(computed)):
        print(f"\n{table(rows)}")
    used = {key for one, _ in computed for key in (one.source, *(p.source for p in one.published))}
    for key in sorted(used):
        print(f"\n- **{key}**: {sources[key]}" if given.markdown else f"\n{key}: {sources[key]}")


if __name__ == "__main__":
    main()
