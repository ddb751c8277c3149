"""An infrared image and a visible picture of one chip, with a known map between them.

The geometry is NIST's (Heigel and Whitenton, 2010): infrared 160 x 120 pixels of 6 um, and a
visible camera with finer pixels that looks through the same optics. What is bright differs:
infrared by temperature and emissivity, visible by reflection and texture.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import cos, pi, radians, sin
from typing import ClassVar

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from chipglow.camera import Camera, GaussianPSF, Measurement
from chipglow.scene import Material, Raster, Scene, Tool, ToolGeometry
from chipglow.surface import CHIP_1

ROWS, COLUMNS, PITCH = 120, 160, 6e-6
VISIBLE_SHAPE = (480, 640)
FINE = Raster(left=-620e-6, top=520e-6, spacing=2e-6, rows=360, columns=480)
SHEAR_ANGLE, FEED, CHIP_ANGLE = radians(32.0), 300e-6, radians(14.0)
TOOL = ToolGeometry()


@dataclass(frozen=True)
class TwoCameraView:
    """How the visible camera sees what the infrared one does; what is random follows the seed.

    The place `middle` in m is in the middle of its picture but for the shift in pixels.
    """

    seed: int = 1
    pitch: float = 1.5e-6
    turn: float = radians(1.5)
    stretch: float = 1.02
    shift: tuple[float, float] = (11.3, -7.6)
    perspective: tuple[float, float] = (0.0, 0.0)
    visible_shape: tuple[int, int] = VISIBLE_SHAPE
    middle: ClassVar[tuple[float, float]] = (0.0, 0.0)

    @cached_property
    def matrix(self):
        """Position in m to column and row of the visible picture."""
        turn = np.array([[cos(self.turn), -sin(self.turn)], [sin(self.turn), cos(self.turn)]])
        matrix = np.eye(3)
        matrix[:2, :2] = turn @ np.diag([self.stretch, -1.0]) / self.pitch
        matrix[2, :2] = self.perspective
        centre = np.array(self.visible_shape[::-1]) / 2 - 0.5 + self.shift
        matrix[:2] += np.outer(centre, matrix[2])
        matrix[:, 2] -= matrix[:, :2] @ self.middle
        return matrix

    def pixels(self, positions):
        """Where positions in m truly are in the visible picture."""
        whole = np.concatenate([positions, np.ones((len(positions), 1))], axis=1) @ self.matrix.T
        return whole[:, :2] / whole[:, 2:]

    def places(self, columns, rows):
        """Positions in m of columns and rows of the visible picture, shape (row, column, 2)."""
        columns, rows = np.meshgrid(columns, rows)
        whole = np.stack([columns, rows, np.ones(rows.shape)], -1) @ np.linalg.inv(self.matrix).T
        return whole[..., :2] / whole[..., 2:]

    def photograph(self, bright, noise, generator):
        """Visible picture of what is bright, with blur and noise."""
        seen = gaussian_filter(bright, 1.2) + generator.normal(0.0, noise, bright.shape)
        return np.clip(np.rint(seen), 0, 255).astype(np.uint8)


@dataclass(frozen=True)
class DualSpectrum(TwoCameraView):
    """One experiment; the seed determines all random values."""

    noise: float = 0.005
    visible_noise: float = 4.0
    chip_brightness: float = 0.75
    grain: float = 0.15
    band_spacing: float = 130e-6
    tool: Tool = TOOL
    middle = (FINE.left + COLUMNS * PITCH / 2, FINE.top - ROWS * PITCH / 2)

    @cached_property
    def infrared(self):
        optics = Camera(pitch=PITCH, psf=GaussianPSF(12e-6), shape=(ROWS, COLUMNS))
        clean = optics.measure(self.scene, replace(CHIP_1, follow="mean"), 0.0)
        generator = np.random.default_rng([self.seed, 1])
        noise = self.noise * np.percentile(clean.radiance, 98)
        radiance = clean.radiance + generator.normal(0.0, noise, clean.radiance.shape)
        camera = {"integration_time": 10e-6, "frame_rate": 600.0}
        described = clean.band, clean.times, clean.raster, 573.15
        measured = Measurement.from_radiance(radiance, *described, attributes=camera)
        return measured.with_tool(self.tool)

    @cached_property
    def visible(self):
        """Visible picture: bright flanks with grain, dark gaps, the tool's edge."""
        rows, columns = (np.arange(count) for count in VISIBLE_SHAPE)
        place = self.places(columns, rows)
        chip, work, tool, phase = shapes(place, self.tool, self.band_spacing)
        generator = np.random.default_rng([self.seed, 2])
        lamella = self.chip_brightness * (1.0 - 0.55 * np.exp(-((phase / 0.09) ** 2)))
        grain = texture(generator, place, 9e-6)
        scratch = texture(generator, place * [0.1, 1.0], 4e-6)
        bright = np.full(VISIBLE_SHAPE, 0.08)
        bright = np.where(work, 0.45 + 0.10 * grain, bright)
        bright = np.where(chip, lamella * (1.0 + self.grain * grain), bright)
        bright = np.where(tool, 0.30 + 0.06 * scratch, bright)
        light = 1.0 - 0.25 * ((columns / VISIBLE_SHAPE[1]) - 0.4) ** 2
        return self.photograph(220.0 * bright * light, self.visible_noise, generator)

    @cached_property
    def scene(self):
        place = np.stack(np.meshgrid(FINE.x, FINE.y), axis=-1)
        chip, work, tool, phase = shapes(place, self.tool, self.band_spacing)
        depth = self.tool.signed_distance(place[..., 0], place[..., 1])
        along = (place - self.tool.rake_point(0.0)) @ np.array(self.tool.rake_direction)
        contact = np.exp(-np.maximum(along - 180e-6, 0.0) / 60e-6) * (along > -40e-6)
        friction = 480.0 * contact * np.exp(-np.abs(depth) / 45e-6)
        band = 260.0 * np.exp(-((phase / 0.1) ** 2))
        shear = place[..., 0] * sin(SHEAR_ANGLE) + place[..., 1] * cos(SHEAR_ANGLE)
        primary = 330.0 / (1 + np.exp(-np.clip(shear / 12e-6, -50, 50)))
        rise = np.where(chip, primary + band + friction, 0.0)
        machined = 230.0 * np.exp(np.minimum(place[..., 1], 0.0) / 25e-6)
        ahead = np.where(place[..., 0] < 5e-6, primary, machined)
        rise = np.where(work, ahead, rise)
        rise = np.where(tool, 40.0 + friction, rise)
        material = np.where(chip | work, Material.WORKPIECE, Material.VOID)
        material = np.where(tool, Material.TOOL, material).astype(np.uint8)
        none = np.zeros((1, *FINE.shape))
        fields = {
            "temperature": (293.15 + rise)[None],
            "plastic_strain": np.where(chip, 1.5, 0.0)[None],
            "plastic_strain_rate": none,
            "velocity_x": none,
            "velocity_y": none,
            "material": material[None],
        }
        frames = {name: np.repeat(values, 2, axis=0) for name, values in fields.items()}
        return Scene.from_fields(FINE, [0.0, 20e-6], frames, tool=self.tool)


def shapes(place, tool, band_spacing):
    """Return masks of chip, workpiece and tool, and the phase between two shear bands."""
    x, y = place[..., 0], place[..., 1]
    depth = tool.signed_distance(x, y)
    inside = depth < 0
    shear = x * sin(SHEAR_ANGLE) + y * cos(SHEAR_ANGLE)
    along = (place - tool.rake_point(0.0)) @ np.array(tool.rake_direction)
    turns = (along + 0.55 * depth) / band_spacing
    phase = turns - np.rint(turns)
    thickness = 330e-6 - 60e-6 * np.abs(2 * phase) - 20e-6 * np.cos(2 * pi * turns / 3)
    lift = np.maximum(along - 260e-6, 0.0) * np.tan(CHIP_ANGLE)
    left = x < 5e-6
    chip = (shear > 0) & left & (depth > lift) & (depth - lift < thickness) & ~inside
    chip &= y > 0
    work = ((shear <= 0) | ~left) & (y < np.where(left, FEED, 0.0)) & ~inside & ~chip
    return chip, work, inside, phase


def texture(generator, place, size):
    """Return grain of a size in m, with mean 0 and standard deviation 1."""
    side = 512
    field = gaussian_filter(generator.standard_normal((side, side)), 1.5, mode="wrap")
    field /= field.std()
    where = np.moveaxis((place + 1e-3) / (size / 3), -1, 0)
    return map_coordinates(field, where % side, order=1, mode="grid-wrap")
