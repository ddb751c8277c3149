"""A chip in closed form: straight shear band, moving workpiece, contact that ends.

Workpiece flows to the right, crosses the shear plane from the edge to the free surface and leaves
up the rake face; the shear band is a Gaussian ridge of strain rate and temperature along a line
whose angle drifts with time. Every quantity that the analyses look for is an attribute.
"""

from dataclasses import dataclass, field
from functools import lru_cache
from math import cos, log, radians, sin, tan

import numpy as np
from numpy.typing import NDArray

from chipglow.cutting import CuttingSimulation, EnergyHistory, ForceHistory
from chipglow.scene import Material, Raster, Scene, ToolGeometry

ROOM = 293.15


@dataclass(frozen=True)
class AnalyticChip:
    """What the scene holds, in SI units."""

    tool: ToolGeometry = field(default_factory=ToolGeometry)
    raster: Raster = field(
        default_factory=lambda: Raster(
            left=-336e-6, top=300e-6, spacing=2e-6, rows=168, columns=210
        )
    )
    frame_spacing: float = 0.5e-6
    frames: int = 80
    speed: float = 250 / 60
    feed: float = 200e-6
    shear_angle: float = radians(38.0)
    shear_angle_drift: float = radians(0.05) / 1e-6
    band_width: float = 20e-6
    peak_rate: float = 80e3
    peak_rise: float = 420.0
    grown_at: float = 28e-6
    contact_length: float = 150e-6
    rake_rise: float = 500.0
    segment_period: float = 72e-6

    @property
    def edge(self) -> NDArray[np.float64]:
        """Where the band leaves the edge's arc, in m."""
        return self.tool.corners[-1] - self.tool.edge_radius / np.sqrt(2)

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the frames in s."""
        return self.frame_spacing * np.arange(self.frames)

    @property
    def field_of_view(self) -> dict[str, str | int]:
        """Section of a study that has the scene's samples."""
        lengths = {name: f"{getattr(self.raster, name)} m" for name in ("left", "top", "spacing")}
        return {**lengths, "rows": self.raster.rows, "columns": self.raster.columns}

    def angle(self, time: float) -> float:
        """Angle of the band over the horizontal in rad."""
        return self.shear_angle + self.shear_angle_drift * time

    def distance_to_band(self, points, time):
        """Signed distance from the band's line in m, positive in the chip."""
        angle = self.angle(time)
        offset = points - self.edge
        return np.asarray(offset[..., 0] * sin(angle) + offset[..., 1] * cos(angle))

    def band_length(self, time: float) -> float:
        """From the edge to the free surface along the band in m."""
        return (self.feed - float(self.edge[1])) / sin(self.angle(time))

    def growth(self, time: float) -> float:
        """Fraction of the band's full strength: 1 when fully grown."""
        return float(np.exp(-(((time - self.grown_at) / 18e-6) ** 2)))

    @lru_cache(maxsize=3)  # noqa: B019
    def scene(self) -> Scene:
        """The scene with its force history."""
        frames = [self._fields(time) for time in self.times]
        fields = {name: np.stack([frame[name] for frame in frames]) for name in frames[0]}
        scene = Scene.from_fields(self.raster, self.times, fields, tool=self.tool)
        time, cutting, thrust = self.forces()
        units = {"units": "N/m"}
        return Scene(
            scene.data.assign(
                cutting_force=("force_time", cutting, units),
                thrust_force=("force_time", thrust, units),
                chip_thickness=("force_time", self.passing(time), {"units": "m"}),
            ).assign_coords(force_time=("force_time", time, {"units": "s"}))
        )

    def forces(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Force history: a rise, then a swing with the segments."""
        time = np.arange(0.0, 470e-6, 0.5e-6)
        rise = 1 - np.exp(-time / 15e-6)
        swing = np.cos(2 * np.pi * (time - 100e-6) / self.segment_period)
        noise = np.random.default_rng(7).normal(0.0, 3e3, (2, time.size))
        cutting = rise * (450e3 + 30e3 * swing) + noise[0]
        return time, cutting, rise * (180e3 + 20e3 * swing) + noise[1]

    def passing(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the thickness in m that passes a line, 25 % less in a valley than at a peak."""
        swing = np.cos(2 * np.pi * (time - 100e-6) / self.segment_period)
        return np.asarray(350e-6 + 50e-6 * swing)

    def cut_history(self) -> ForceHistory:
        """The same as a cutting simulation gives it; 2 % of the work is not found again."""
        time, cutting, thrust = self.forces()
        work = np.cumsum(np.maximum(cutting, 0.0)) * 0.5e-6 * 250.0 / 60.0 + 1e-3
        nothing = np.zeros(time.size)
        energy = EnergyHistory(
            work, nothing, nothing, nothing, 0.9 * work, 0.08 * work, nothing, nothing, nothing,
            nothing,
        )  # fmt: skip
        return ForceHistory(
            time, cutting, thrust, self.passing(time), energy, self.scene().frame(0)
        )

    def _fields(self, time):
        points = np.stack(np.meshgrid(self.raster.x, self.raster.y), axis=-1)
        across = self.distance_to_band(points, time)
        across = np.where(points[..., 0] < self.edge[0], across, -1e-3)
        depth = self.tool.signed_distance(points[..., 0], points[..., 1])
        along = (points - self.tool.rake_point(0.0)) @ np.array(self.tool.rake_direction)
        material = self._material(points, across, depth, along)
        chip = (material == Material.WORKPIECE) & (across > 0)
        sigma = self.band_width / np.sqrt(8 * log(2))
        ridge = self.growth(time) * np.exp(-0.5 * (across / sigma) ** 2)
        sheared = 1 / (1 + np.exp(-np.clip(across / (0.3 * self.band_width), -60, 60)))
        contact = 1 / (1 + np.exp(np.clip((along - self.contact_length) / 15e-6, -60, 60)))
        friction = self.rake_rise * contact * np.exp(-np.abs(depth) / 25e-6)
        rise = np.where(
            material == Material.TOOL,
            friction * (1 + 180 / self.rake_rise),
            180 * sheared + self.peak_rise * ridge + friction * sheared,
        )
        solid = material == Material.WORKPIECE
        chip_speed = self.speed * sin(self.shear_angle)
        chip_speed /= cos(self.shear_angle - self.tool.rake_angle)
        direction = np.array(self.tool.rake_direction)
        velocity = np.where(chip[..., None], chip_speed * direction, [self.speed, 0.0])
        velocity = np.where(solid[..., None], velocity, 0.0)
        origin = self._origin(points, across, chip, chip_speed * direction, time)
        return {
            "temperature": np.where(material == Material.VOID, ROOM, ROOM + rise),
            "plastic_strain": np.where(solid, 2.2 * sheared, 0.0),
            "plastic_strain_rate": np.where(solid, self.peak_rate * ridge, 0.0),
            "velocity_x": velocity[..., 0],
            "velocity_y": velocity[..., 1],
            "material": material,
            "material_x": origin[..., 0],
            "material_y": origin[..., 1],
        }

    def _material(self, points, across, depth, along):
        """Free surface where the mean band meets it; the chip lifts off where contact ends."""
        corner = self.edge + self.band_length(0.0) * np.array(
            [-cos(self.shear_angle), sin(self.shear_angle)]
        )
        back = np.array(self.tool.rake_normal) @ (points - corner).transpose(2, 0, 1).reshape(2, -1)
        lift = np.maximum(0.0, along - self.contact_length) * tan(radians(12.0))
        left_of_edge = points[..., 0] < self.edge[0]
        uncut = (across <= 0) & (points[..., 1] < np.where(left_of_edge, self.feed, 0.0))
        chip = (across > 0) & (back.reshape(across.shape) < 0) & (depth >= lift)
        solid = (uncut | chip) & (depth >= 0)
        material = np.where(solid, Material.WORKPIECE, Material.VOID)
        return np.where(depth < 0, Material.TOOL, material).astype(np.uint8)

    def _origin(self, points, across, chip, chip_velocity, time):
        """Where each point was before the cut: back down the chip, then back to the left."""
        angle = self.angle(time)
        closing = chip_velocity @ np.array([sin(angle), cos(angle)])
        since = np.where(chip, across / closing, 0.0)[..., None]
        crossing = points - since * chip_velocity
        return np.asarray(crossing - (time - since) * np.array([self.speed, 0.0]))


def replace_cut(monkeypatch, scene):
    """Replace the cutting simulation by a chip in closed form; returns the list of its runs."""
    calls = []

    def cut_chip(simulation, window, raster, on_frame, on_progress, resume, on_checkpoint, preview):
        calls.append(simulation)
        for frame in scene.frames():
            on_frame(frame)
            if preview:
                preview.on_frame(frame)
        on_progress(1.0)
        return AnalyticChip().cut_history()

    monkeypatch.setattr(CuttingSimulation, "run", cut_chip)
    monkeypatch.setattr(CuttingSimulation, "overview_raster", AnalyticChip().raster)
    monkeypatch.setattr(CuttingSimulation, "lattice", lambda *_: None)  # it has samples only
    return calls
