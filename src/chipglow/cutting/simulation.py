"""The cutting simulation: a workpiece driven against a rigid, conducting tool."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import ceil, inf, nan, sqrt
from typing import Any, Final, NamedTuple

import numpy as np
from numba import get_num_threads
from numpy.typing import NDArray

from chipglow.cutting.conditions import (
    CutSettings,
    CuttingConditions,
    Numerics,
    OutputWindow,
    unresolved,
)
from chipglow.cutting.damage import Damage
from chipglow.cutting.heat import (
    CELLS,
    HeatLoss,
    ToolHeat,
    border_nodes,
    conduct,
    conduct_beyond,
    conduct_tool,
    heat_contact,
    lose_heat,
    return_heat,
    tool_fraction as fraction_of_tool,
)
from chipglow.cutting.library import tool_material, workpiece
from chipglow.cutting.material import ROOM_TEMPERATURE, ToolMaterial, WorkpieceMaterial
from chipglow.cutting.mean_rate import average_rates
from chipglow.cutting.momentum import (
    BOUNDARY_WORK,
    CONTACT_WORK,
    FORCE_X,
    FORCE_Y,
    NODE_VALUES,
    PLASTIC_WORK,
    SUMS,
    VELOCITY_VALUES,
    VELOCITY_X,
    Step,
    advance_with,
)
from chipglow.cutting.picture import Picture, lattice_of
from chipglow.cutting.points import (
    POINT,
    Grid,
    Points,
    Trouble,
    block_of_points,
    find_lost,
    find_off_grid,
    find_trouble,
    sort_by_cell,
)
from chipglow.cutting.recording import (
    ENERGIES,
    Checkpoint,
    EnergyHistory,
    Preview,
    Recorder,
    capture,
    held_energy,
    restore,
)
from chipglow.cutting.steady_tool import SteadyTool, ToolBody, beyond, steady_temperature
from chipglow.quantities import ROUNDING, Brief
from chipglow.scene import Frame, Raster, Tool, ToolGeometry
from chipglow.scene.splines import Lattice
from chipglow.scene.tool_surface import ToolSurface, surface_distances

SOLVER_VERSION: Final = "12"
"""Changes whenever the same input gives another result."""

SCAN_FEEDS: Final = 1.5
"""Height of the line on which the chip's thickness is read, in feeds up the rake face.

The line is at right angles to the rake face, over the uncut surface and most often in contact.
"""

_MARGIN_CELLS: Final = 4
"""Cells of the grid on each side of the region: points start two cells before it, and their splines
reach two more."""

_GAP: Final = 5.0
"""Spacings of points without a point that part the chip from other material."""

_CONTACT_STIFFNESS: Final = 50e9
"""Force on a point per width and depth of its contact in Pa: a pressure of 1 GPa pushes points that
are 5 µm apart 0.1 µm into the tool."""

_CONTACT_DAMPING: Final = 0.2
"""Damping of the contact as a fraction of the critical one, so that points do not bounce off the
tool."""

_MAX_DRIFT: Final = 0.1
"""Cells by which the workpiece may move between two sortings of the points into cells."""

_MAX_FASTEST_DRIFT: Final = 0.4
"""Cells by which the fastest point may move between two sortings."""

_HEAT_STABILITY: Final = 0.15
"""Time step of conduction in cell² over diffusivity; explicit conduction in two dimensions is
stable below 0.25."""

_USUAL_FLOW: Final = (1.0, 1e4)
"""Plastic strain, and its rate in 1/s, at which the flow stress gives the usual cutting force."""

_INERTIA_SHARE: Final = 0.0045
"""Momentum flow of the scaled mass as a fraction of the usual cutting force; see `mass_scaling`."""

_MAX_MASS_SCALING: Final = 1000.0
"""Largest factor on the density that is chosen, for slow cuts."""

_NO_BAND_WIDTH: Final = (
    "The workpiece has no nonlocal viscosity: a shear band is about two cells wide, of any cell."
)

STEADY_TOLERANCE: Final = 1.0
"""Change in K of the contact's mean temperature, over the last rounds, under which a tool counts as
steady."""

_ROUND_LENGTH: Final = 2.0
"""Length of cut of a round of the steady tool in feeds: about two segments."""

_COARSE_CELLS: Final = 12.0
"""Cells in a feed of the cut that warms the tool."""

_FULL_ROUNDS: Final = 3
"""Rounds after which the temperature becomes the mean of the rounds, since segments differ."""

_SETTLED_ROUNDS: Final = 3
"""Last rounds over which the contact's temperature is compared with `STEADY_TOLERANCE`."""

_MAX_ROUNDS: Final = 48
"""Rounds after which a tool that is not steady is an error."""

_USUAL_ROUNDS: Final = 18
"""Rounds from which the expected time of a cut is computed."""


class SolverError(RuntimeError):
    """A simulation that went wrong: what, where and when."""


@dataclass(frozen=True, repr=False)
class ForceHistory(Brief):
    """Force of the tool on the workpiece per width of cut, over the whole cut."""

    time: NDArray[np.float64]
    """Ends of the intervals over which the forces are averaged, in s, shape (n,)."""
    cutting: NDArray[np.float64]
    thrust: NDArray[np.float64]
    """Against the motion of the workpiece, and away from the tool into it, in N/m, shape (n,)."""
    thickness: NDArray[np.float64]
    """Thickness of the chip in m at the ends of the intervals, shape (n,); see `SCAN_FEEDS`."""
    energy: EnergyHistory
    overview: Frame
    """The whole computed region at the end, on `CuttingSimulation.overview_raster`."""


@dataclass(frozen=True)
class CuttingSimulation(CutSettings):
    """Thermo-mechanical simulation of an orthogonal cut in plane strain.

    Material points (MLS-MPM with affine velocities) carry stress, strain, temperature and their
    place before the cut; the tool is rigid and conducts heat. The cut starts at time 0, when the
    workpiece touches the rake face.

    Parameters
    ----------
    conditions : CuttingConditions
        Speed, feed, cutting length.
    tool : Tool
        Outline of the tool.
    workpiece : WorkpieceMaterial
        The workpiece's material.
    tool_material : ToolMaterial
        The tool's material.
    tool_temperature : float or ToolBody, optional
        Initial temperature of the tool in K. A body: the steady-state temperature of a long cut,
        by conduction through this body. None: the temperature of the workpiece, as in the paper.
    """

    conditions: CuttingConditions = field(default_factory=CuttingConditions)
    tool: Tool = field(default_factory=ToolGeometry)
    workpiece: WorkpieceMaterial = field(default_factory=partial(workpiece, "aisi-1045"))
    tool_material: ToolMaterial = field(default_factory=partial(tool_material, "carbide"))
    tool_temperature: float | ToolBody | None = None

    def run(
        self,
        window: OutputWindow,
        raster: Raster,
        on_frame: Callable[[Frame], None],
        on_progress: Callable[[float], None] | None = None,
        resume: Checkpoint | None = None,
        on_checkpoint: Callable[[Checkpoint], None] | None = None,
        preview: Preview | None = None,
    ) -> ForceHistory:
        """Simulate the cut, hand over its frames in their order, and return its forces.

        The forces are averaged over every interval from the start of the cut to the end of the
        window, or of the cut if bands after the window are recorded. `on_progress` gets the
        fraction of the cut that is done. `on_checkpoint` gets the state after every interval, in
        the simulation's own arrays: write or copy them before you return. A run that resumes from
        it has the results of an unbroken one with the same window, to the last bit, and hands over
        only the frames that are still to come. `preview` shows the cut while it is computed.
        """
        recorder = self._recorder(window)
        state = _State(self, window.interval)
        if isinstance(self.tool_temperature, ToolBody) and resume is None:
            state.warm(self.steady_tool(), self.tool_temperature)
        picture = state.picture(raster)
        coarse = state.picture(preview.raster) if preview is not None else None
        last = recorder.last
        records = np.empty((last, 3 + ENERGIES))
        done = restore(state, resume, records) if resume is not None else 0
        recorder.replay(records[:done, 0])
        for record in range(done + 1, last + 1):
            records[record - 1] = state.advance()
            if recorder.wants(record, records[record - 1, 0]):
                on_frame(state.frame(picture))
            if preview is not None and coarse is not None and preview.shows(record, last):
                preview.on_frame(state.frame(coarse))
            if on_checkpoint is not None:
                on_checkpoint(capture(state, records[:record], record / last))
            if on_progress is not None:
                on_progress(record / last)
        time = window.interval * np.arange(1, last + 1, dtype=np.float64)
        cutting, thrust, thickness, *energies = records.T.copy()
        overview = state.frame(state.picture(self.overview_raster))
        return ForceHistory(time, cutting, thrust, thickness, EnergyHistory(*energies), overview)

    @property
    def momentum_flow(self) -> float:
        """Momentum of the scaled mass that arrives at the tool per time and width, in N/m.

        ρV² times the uncut chip thickness: inertia can matter that much beside the cutting force.
        """
        cold = float(self.workpiece.density_at(self.conditions.initial_temperature))
        density = cold * self.mass_scaling
        return density * self.conditions.speed**2 * self.conditions.feed

    @cached_property
    def mass_scaling(self) -> float:
        """Factor on the density in the equation of motion.

        The value in the numerics, if any. If not, so much that the momentum of the scaled mass
        makes 0.45 % of a cutting force of √3 σ times the uncut chip thickness, with the flow
        stress σ at a strain of 1, 10⁴ 1/s and the initial temperature (a cutting force of three
        times the shear flow stress is usual for steel); from 1 to 1000.
        """
        if self.numerics.mass_scaling is not None:
            return self.numerics.mass_scaling
        start = self.conditions.initial_temperature
        strength = float(self.workpiece.flow_stress.at(*_USUAL_FLOW, start))
        dynamic = float(self.workpiece.density_at(start)) * self.conditions.speed**2
        scaling = _INERTIA_SHARE * sqrt(3.0) * strength / dynamic
        return min(max(scaling, 1.0), _MAX_MASS_SCALING)

    @property
    def resolution_warnings(self) -> tuple[str, ...]:
        """Sentences on lengths that fewer than `CELLS_NEEDED` cells resolve."""
        lengths = {"feed": self.conditions.feed, "edge radius": self.tool.corner_radius}
        resists = self.workpiece.nonlocal_viscosity
        if resists is not None:
            lengths["length of the nonlocal viscosity"] = resists.length
            return unresolved(lengths, self.numerics.cell)
        return (*unresolved(lengths, self.numerics.cell), _NO_BAND_WIDTH)

    @property
    def point_count(self) -> float:
        """Material points of the whole workpiece, about: its memory follows them."""
        return self._points(self.conditions.cutting_length)

    @property
    def point_steps(self) -> float:
        """Material points times time steps of the whole cut, about: its time follows them.

        With a steady tool it includes those of the cut that warms the tool.
        """
        numerics, conditions = self.numerics, self.conditions
        step = numerics.courant * numerics.cell / (_sound(self) + conditions.speed)
        own = self._points() * conditions.cutting_length / conditions.speed / step
        if not isinstance(self.tool_temperature, ToolBody):
            return own
        return own + self._long_cut().point_steps * _USUAL_ROUNDS / _MAX_ROUNDS

    def _points(self, beyond: float = 0.0) -> float:
        """Return the points in the computed region, and in a length in m that it does not hold."""
        numerics, feed = self.numerics, self.conditions.feed
        length = numerics.upstream + numerics.downstream + beyond
        return length * (numerics.depth + feed) * (numerics.points_per_side / numerics.cell) ** 2

    def steady_tool(self) -> SteadyTool:
        """Return the tool after a long cut: cut and conduct in turn until it is steady.

        A cut on a coarser grid gives the heat that enters the tool, averaged over about two
        segments; conduction in the tool's body gives the temperature that this heat makes. The
        warmer the tool is, the more of the heat the chip takes, as a half-space would that slides
        past the contact (Jaeger). With that slope each round comes close to where cut and
        conduction agree; after the third, rounds are averaged, since segments differ.
        """
        body = self.tool_temperature
        if not isinstance(body, ToolBody):
            raise ValueError(f"tool_temperature: {body!r}, expected the body of a tool")
        coarse = self._long_cut()
        distance = coarse.conditions.cutting_length / _MAX_ROUNDS
        state = _State(coarse, distance / self.conditions.speed)
        rounds: list[float] = []
        for number in range(1, _MAX_ROUNDS + 1):
            rounds.append(state.heat_through(body, number))
            recent = rounds[-_SETTLED_ROUNDS:]
            if (
                number > _FULL_ROUNDS + _SETTLED_ROUNDS
                and max(recent) - min(recent) < STEADY_TOLERANCE
            ):
                break
        else:
            raise SolverError(
                f"warm tool: the contact's temperature still changes by "
                f"{max(recent) - min(recent):.1f} K in {_SETTLED_ROUNDS} rounds, "
                f"expected less than {STEADY_TOLERANCE:g}"
            )
        return SteadyTool(state.grid, state.tool_fraction, state.tool_temperature, tuple(rounds))

    def _long_cut(self) -> "CuttingSimulation":
        """Return the cut that gives the heat of a steady tool, as long as it may become."""
        feed = self.conditions.feed
        return replace(
            self,
            conditions=replace(self.conditions, cutting_length=_MAX_ROUNDS * _ROUND_LENGTH * feed),
            numerics=replace(self.numerics, cell=max(self.numerics.cell, feed / _COARSE_CELLS)),
            tool_temperature=None,
        )

    def _recorder(self, window: OutputWindow) -> Recorder:
        length = self.conditions.cutting_length
        if window.end > length * (1 + ROUNDING):
            raise ValueError(
                f"window end: {window.end * 1e3:g} mm is beyond the cutting length of "
                f"{length * 1e3:g} mm"
            )
        recorder = Recorder(window, self.conditions.speed, length)
        if recorder.last < recorder.first:
            raise ValueError(
                f"window: no frame between {window.start * 1e3:g} mm and {window.end * 1e3:g} mm "
                f"with an interval of {window.interval * 1e6:g} us"
            )
        return recorder

    @property
    def overview_raster(self) -> Raster:
        """Samples of a quarter of a cell over the computed region."""
        grid, samples = _grid(self.numerics), 4  # per side of a cell
        leaving = 2  # cells at the right and at the top, through which the material leaves
        left = grid.left + _MARGIN_CELLS * grid.cell
        top = grid.bottom + (grid.rows - 1 - _MARGIN_CELLS - leaving) * grid.cell
        rows, columns = (
            samples * (count - 1 - 2 * _MARGIN_CELLS - leaving)
            for count in (grid.rows, grid.columns)
        )
        return Raster(left, top, grid.cell / samples, rows, columns)

    def lattice(self, raster: Raster) -> Lattice:
        """Return the nodes whose splines the frames are; the raster must be simulated."""
        grid = _grid(self.numerics)
        left, right, bottom, top = raster.extent
        edge = 3 * grid.cell  # more than the 1.5 cells that a spline reaches
        inside = (
            left >= grid.left + edge
            and bottom >= grid.bottom + edge
            and right <= grid.left + grid.columns * grid.cell - 2 * edge
            and top <= grid.bottom + grid.rows * grid.cell - 2 * edge
        )
        if not inside:
            raise ValueError(
                f"field of view: x {left * 1e6:.0f} to {right * 1e6:.0f} um, "
                f"y {bottom * 1e6:.0f} to {top * 1e6:.0f} um reaches beyond the simulated region"
            )
        return lattice_of(grid, raster, self.tool, self.conditions.initial_temperature)


class _Metal(NamedTuple):
    """The workpiece's material as the kernels take it."""

    law: Any
    damage: Damage
    elastic: NDArray[np.float64]
    capacity: NDArray[np.float64]  # heat capacity in J/(kg K), sampled over the temperature
    heat_fractions: NDArray[np.float64]
    conductivity: NDArray[np.float64]  # in W/(m K), sampled over the temperature
    diffusivity: float  # in m²/s at the initial temperature
    effusivity: float  # in J/(m² K √s) at the initial temperature

    @classmethod
    def of(cls, simulation: CuttingSimulation) -> "_Metal":
        material, start = simulation.workpiece, simulation.conditions.initial_temperature
        conductivity = float(material.conductivity.at(start))
        capacity = float(material.density_at(start) * material.heat_capacity.at(start))
        return cls(
            law=material.flow_stress.numbers(),
            damage=Damage.of(material.damage, material.failing_layer(simulation.numerics.cell)),
            elastic=material.elastic_ratios(),
            capacity=material.heat_capacity.sampled(),
            heat_fractions=material.heat_fractions(),
            conductivity=material.conductivity.sampled(),
            diffusivity=conductivity / capacity,
            effusivity=sqrt(conductivity * capacity),
        )


def _step_of(simulation: CuttingSimulation) -> Step:
    """Return the constants of a step; the time step is 0 until it is chosen."""
    conditions, numerics = simulation.conditions, simulation.numerics
    material, friction = simulation.workpiece, simulation.friction
    spacing = _spacing(numerics)
    heat_mass = float(material.density_at(conditions.initial_temperature)) * spacing**2
    mass = heat_mass * simulation.mass_scaling
    resists, exponent = material.nonlocal_viscosity, friction.thermal_exponent
    return Step(
        mass=mass,
        heat_mass=heat_mass,
        volume=heat_mass / float(material.density_at(ROOM_TEMPERATURE)),
        time_step=0.0,
        shear_modulus=float(material.shear_modulus_at(ROOM_TEMPERATURE)),
        bulk_modulus=float(material.bulk_modulus_at(ROOM_TEMPERATURE)),
        stiffness=_CONTACT_STIFFNESS,
        damping=_CONTACT_DAMPING * 2 * np.sqrt(_CONTACT_STIFFNESS * mass),
        reach=spacing / 2,
        area=spacing,
        friction=friction.coefficient,
        friction_factor=friction.friction_factor,
        floor=-numerics.depth,
        inflow=-numerics.upstream,
        ceiling=conditions.feed + 2 * numerics.cell,
        speed=conditions.speed,
        friction_exponent=exponent or 1.0,
        friction_melting=inf if exponent is None else material.melting_temperature,
        viscosity=resists.viscosity if resists is not None else 0.0,
    )


def _tool_heat(simulation: CuttingSimulation, effusivity: float) -> ToolHeat:
    """Return the heat of the tool; friction heat is shared by the effusivities in contact."""
    tool = simulation.tool_material
    return ToolHeat(
        capacity=tool.density * tool.heat_capacity,
        conductivity=tool.conductivity,
        friction_fraction=float(tool.effusivity / (tool.effusivity + effusivity)),
        conductance=simulation.friction.conductance,
        area=_spacing(simulation.numerics),
    )


class _State:
    """State of a running simulation, advanced by an interval in s at a time."""

    def __init__(self, simulation: CuttingSimulation, interval: float) -> None:
        conditions, numerics = simulation.conditions, simulation.numerics
        self.simulation, self.interval = simulation, interval
        self.speed, self.spacing = conditions.speed, _spacing(numerics)
        self.grid = _grid(numerics)
        self.tool = simulation.tool.surface
        self.step = _step_of(simulation)
        self.metal = _Metal.of(simulation)
        self.step_points = advance_with(self.metal.law)
        self.tool_heat = _tool_heat(simulation, self.metal.effusivity)
        self.loss = HeatLoss.of(simulation.surroundings, numerics)
        self._start_grid()
        self._start_tool()
        self._start_points(conditions, numerics)
        self.time = 0.0
        self.choose_steps()
        self.work = np.zeros(SUMS)
        self.carried = 0.0
        self.lost_heat = 0.0
        self.held_at_start = self._held()

    def _start_grid(self) -> None:
        """Make the arrays of the nodes, which move with the workpiece."""
        shape = (self.grid.columns, self.grid.rows)
        self.velocity = np.zeros((*shape, VELOCITY_VALUES))
        self.velocity[..., VELOCITY_X] = self.speed
        self.nodes = np.zeros((*shape, NODE_VALUES))
        self.heat_nodes = np.zeros((*shape, 3))
        self.increment = np.zeros(shape)
        self.entered = np.zeros((*shape, 2))
        self.contact_area = np.zeros(shape)
        self.friction_heat = np.zeros(shape)
        self.starts = np.zeros(self.grid.columns * self.grid.rows + 1, np.int64)

    def _start_tool(self) -> None:
        """Give the tool its initial temperature, on the grid and beyond."""
        given = self.simulation.tool_temperature
        start = self.simulation.conditions.initial_temperature
        initial = given if isinstance(given, float) else start
        self.tool_fraction = fraction_of_tool(self.grid, self.tool)
        self.tool_temperature = np.full((self.grid.columns, self.grid.rows), initial)
        self.tool_border = border_nodes(self.tool_fraction)
        self.tool_beyond = np.full((len(self.tool_border), CELLS), initial)

    def warm(self, tool: SteadyTool, body: ToolBody) -> None:
        """Give the tool the temperature of a long cut."""
        self.tool_temperature = tool.on(self.grid, self.tool_fraction)
        self.tool_beyond = beyond(self.grid, self.tool_border, self.tool_temperature, body)

    def heat_through(self, body: ToolBody, number: int) -> float:
        """Cut for an interval, update the tool's temperature by its heat; mean in the contact in K.

        `number` is the index of the round; after the third, the mean of the rounds is kept.
        """
        self.entered[:] = 0.0
        begin = self.tool_temperature.copy()
        self.advance()
        heat, area = np.moveaxis(self.entered, -1, 0) / self.interval
        contact = area.sum()
        self.contact_area += area
        if contact <= 0.0:
            raise SolverError("warm tool: the chip did not touch the tool")
        # Jaeger's slider at high speed: mean rise q √(L / V) / (0.94 e) over a contact of length L.
        draining = 0.94 * self.metal.effusivity * sqrt(self.speed / contact) * area
        met = 0.5 * (begin + self.tool_temperature)
        found = steady_temperature(
            self.grid, self.tool_fraction, self.tool_heat, body,
            np.maximum(heat + draining * met, 0.0), draining,
        )  # fmt: skip
        part = 1.0 / max(number - _FULL_ROUNDS, 1)
        self.tool_temperature = begin + part * (found - begin)
        self.tool_beyond = beyond(self.grid, self.tool_border, self.tool_temperature, body)
        return float((self.contact_area * self.tool_temperature).sum() / self.contact_area.sum())

    def _start_points(self, conditions: CuttingConditions, numerics: Numerics) -> None:
        """Fill the region up to where the workpiece's face touches the rake face."""
        self.temperature = conditions.initial_temperature
        pad = 2 * numerics.cell
        layers = ceil((numerics.depth + pad) / self.spacing)
        above = max(round(conditions.feed / self.spacing), 1)
        self.rows = self.spacing * (np.arange(-layers, above, dtype=np.float64) + 0.5)
        self.entry = -numerics.upstream - pad
        heights = np.linspace(0.0, conditions.feed, 64)  # of the face, finer than the cells
        self.face = _touching(self.tool, heights)
        self.columns = 0
        # Four cells and four columns are spare.
        travel = conditions.cutting_length + 4 * numerics.cell
        capacity = int((self.face - self.entry + travel) / self.spacing + 4) * self.rows.size
        self.points = np.zeros(capacity, POINT)
        self.spare = np.zeros(capacity, POINT)
        self.count = 0
        self._let_in(0.0)

    def _let_in(self, time: float) -> None:
        """Add the columns of points that have reached the left edge."""
        first = self.columns
        at_edge = self.face + self.speed * time - self.entry
        self.columns = max(int(at_edge / self.spacing - 0.5) + 1, first)
        original = self.face - self.spacing * (
            np.arange(first, self.columns, dtype=np.float64) + 0.5
        )
        new = block_of_points(original, self.rows, self.spacing, self.temperature, self.speed)
        new["x"] += self.speed * time
        self.points[self.count : self.count + new.size] = new
        self.count += new.size

    def _sort(self) -> None:
        right, top = self.simulation.numerics.downstream, self.simulation.numerics.height
        count = sort_by_cell(
            self.points, self.count, self.grid, right, top, self.spare, self.starts
        )
        if count < 0:
            self._fail("a point's position is not finite", -1 - count)
        if count < self.count:
            points = self.points[: self.count]
            self._stop_at(find_lost(points, self.grid, self.step.ceiling))
        self.points, self.spare = self.spare, self.points
        self.count = count

    @np.errstate(invalid="ignore", over="ignore")  # `find_trouble` finds what is not finite
    def advance(self) -> NDArray[np.float64]:
        """Advance by one interval; return mean forces in N/m, thickness in m, and the energies."""
        sums, threads = np.zeros_like(self.work), get_num_threads()
        metal, resists = self.metal, self.simulation.workpiece.nonlocal_viscosity
        points = self.points[: self.count]
        points["strain_before"] = points["strain"]
        for _ in range(self.cycles):
            before = self._held().sum()
            self._let_in(self.time)
            self._sort()
            self.carried += self._held().sum() - before
            good = self.step_points(
                self.steps, self.points, self.starts, self.velocity, self.nodes,
                self.friction_heat, self.tool, self.grid, self.step, metal.law, metal.damage,
                metal.elastic, metal.capacity, metal.heat_fractions, sums, threads,
            )  # fmt: skip
            self.time += self.cycle
            if not good:
                self._stop_at(find_off_grid(self.points[: self.count], self.grid))
            self._conduct()
            if resists is not None:
                average_rates(self.points, self.count, self.grid, self.cycle, resists.length)
        self._stop_at(find_trouble(self.points[: self.count]))
        self.work += sums
        forces = -sums[[FORCE_X, FORCE_Y]] / (self.cycles * self.steps)
        self.choose_steps(self.grid.cell / self.cycle)
        drive = self.work[BOUNDARY_WORK] + self.carried
        held = self._held() - self.held_at_start
        used = self.work[PLASTIC_WORK:]
        done = drive, self.work[CONTACT_WORK]
        return np.array([*forces, self.thickness(), *done, *held, *used, self.lost_heat])

    def choose_steps(self, allowed: float = inf) -> None:
        """Choose time step and cycles of the next interval, by the fastest point.

        It may not have been faster than `allowed` (m/s) by the steps of the interval before.
        """
        points = self.points[: self.count]
        speed = np.hypot(points["vx"], points["vy"])
        index = int(speed.argmax())
        fastest = float(speed[index])
        sound = _sound(self.simulation)
        if fastest > sound:
            self._fail(
                f"speed of {fastest:.0f} m/s, over the {sound:.0f} m/s of sound, scaled mass", index
            )
        if fastest > allowed:
            self._fail(f"speed of {fastest:.0f} m/s, the time step allows {allowed:.0f} m/s", index)
        self.cycles, self.steps, time_step = _time_steps(self.simulation, self.interval, fastest)
        self.cycle = self.interval / self.cycles
        self.step = self.step._replace(time_step=time_step)

    def _held(self) -> NDArray[np.float64]:
        """Return kinetic and elastic energy of the points in J/m."""
        return np.array(
            held_energy(self.points, self.count, self.step, self.metal.elastic, self.grid.cell)
        )

    def _conduct(self) -> None:
        points, count, grid, cycle = self.points, self.count, self.grid, self.cycle
        nodes, rise, mass = self.heat_nodes, self.increment, self.step.heat_mass
        metal, capacity = self.metal, self.metal.capacity
        tool, filled, heat = self.tool_temperature, self.tool_fraction, self.tool_heat
        part = min(metal.diffusivity * cycle / grid.cell**2, 1.0)
        conduct(points, count, nodes, rise, metal.conductivity, capacity, mass, grid, cycle, part)
        conduct_tool(tool, filled, heat, grid, cycle)
        conduct_beyond(tool, self.tool_beyond, self.tool_border, filled, heat, grid, cycle)
        if self.loss.convection > 0.0 or self.loss.emissivity > 0.0:
            self.lost_heat += lose_heat(nodes, rise, tool, filled, heat, self.loss, grid, cycle)
        heat_contact(
            points, count, self.friction_heat, self.entered, rise, nodes, tool, filled, self.tool,
            heat, capacity, mass, grid,
        )  # fmt: skip
        return_heat(points, count, rise, grid)

    def picture(self, raster: Raster) -> Picture:
        """Return the maker of frames of a raster."""
        return Picture(self.grid, self.simulation.lattice(raster), self.tool_fraction)

    def frame(self, picture: Picture) -> Frame:
        """Return the fields now; the strain rate is the mean over the last interval."""
        points: Points = self.points[: self.count]
        values = {
            "temperature": points["temperature"],
            "plastic_strain": points["strain"],
            "plastic_strain_rate": (points["strain"] - points["strain_before"]) / self.interval,
            "velocity_x": points["vx"],
            "velocity_y": points["vy"],
            "material_x": points["material_x"],
            "material_y": points["material_y"],
        }
        return picture.frame(self.time, points, values, self.tool_temperature)

    def thickness(self) -> float:
        """Return the thickness of the chip in m on the scan line; NaN without a chip there."""
        points, tool = self.points[: self.count], self.simulation.tool
        foot = tool.rake_point(SCAN_FEEDS * self.simulation.conditions.feed)
        x, y = points["x"] - foot[0], points["y"] - foot[1]
        (along_x, along_y), (normal_x, normal_y) = tool.rake_direction, tool.rake_normal
        near = np.abs(x * along_x + y * along_y) < 2.0 * self.spacing
        distance = np.sort(x[near] * normal_x + y[near] * normal_y)
        if distance.size == 0:
            return nan
        # The chip is the longest stretch of material: it may have lifted off the face.
        ends = np.flatnonzero(np.diff(distance) > _GAP * self.spacing)
        first, last = np.append(0, ends + 1), np.append(ends, distance.size - 1)
        return float((distance[last] - distance[first]).max() + self.spacing)

    def _stop_at(self, trouble: Trouble | None) -> None:
        if trouble is not None:
            self._fail(*trouble)

    def _fail(self, what: str, index: int) -> None:
        point = self.points[index]
        known = np.isfinite(point["x"]) and np.isfinite(point["y"])
        x, y = (point[name] for name in (("x", "y") if known else ("material_x", "material_y")))
        raise SolverError(
            f"cutting simulation: {what} at {self.time * 1e6:.2f} us, "
            f"x {x * 1e6:.1f} um, y {y * 1e6:.1f} um{'' if known else ' before the cut'}, "
            f"temperature {point['temperature']:.0f} K; try a smaller courant number"
        )


def _spacing(numerics: Numerics) -> float:
    """Return the distance of neighbouring points before the cut in m."""
    return numerics.cell / numerics.points_per_side


def _grid(numerics: Numerics) -> Grid:
    margin = _MARGIN_CELLS * numerics.cell
    width = numerics.upstream + numerics.downstream + 2 * margin
    height = numerics.depth + numerics.height + 2 * margin
    columns, rows = (round(length / numerics.cell) + 1 for length in (width, height))
    left, bottom = -numerics.upstream - margin, -numerics.depth - margin
    return Grid(left, bottom, numerics.cell, columns, rows)


def _sound(simulation: CuttingSimulation) -> float:
    """Return the speed of sound in the workpiece with its scaled mass in m/s."""
    return simulation.workpiece.sound_speed() / sqrt(simulation.mass_scaling)


def _time_steps(
    simulation: CuttingSimulation, interval: float, fastest: float
) -> tuple[int, int, float]:
    """Return cycles in an interval, steps in a cycle, and the time step in s.

    Within a cycle no point may drift far from the cell it was sorted into, the `fastest` (m/s) as
    little as the others, and explicit conduction must be stable; within a step sound may not cross
    a cell of the moving material.
    """
    material, numerics = simulation.workpiece, simulation.numerics
    drift = min(
        _MAX_DRIFT * numerics.cell / simulation.conditions.speed,
        _MAX_FASTEST_DRIFT * numerics.cell / max(fastest, 1e-9),  # at rest in m/s
    )
    tool, temperature = simulation.tool_material, simulation.conditions.initial_temperature
    diffusivity = max(
        tool.conductivity / (tool.density * tool.heat_capacity),
        max(material.conductivity.values)
        / (float(material.density_at(temperature)) * min(material.heat_capacity.values)),
    )
    heat = _HEAT_STABILITY * numerics.cell**2 / diffusivity
    cycles = ceil(interval / min(drift, heat))
    crossing = numerics.cell / (_sound(simulation) + fastest)
    steps = ceil(interval / cycles / (numerics.courant * crossing))
    return cycles, steps, interval / cycles / steps


def _touching(tool: ToolSurface, heights: NDArray[np.float64]) -> float:
    """Return the place of a vertical face that touches the tool from the left."""
    low, high = -1e-2, 0.0  # 10 mm before the edge, beyond any tool
    for _ in range(60):  # halvings, to the last bit
        middle = (low + high) / 2
        clear = (surface_distances(np.full_like(heights, middle), heights, tool) > 0.0).all()
        low, high = (middle, high) if clear else (low, middle)
    return low
