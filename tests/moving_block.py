"""Sources that a test makes up: fields in closed form, and readers that go wrong."""

import os
import time
from dataclasses import dataclass

import numpy as np

from chipglow.io.sources import Source, SourceError, Survey
from chipglow.scene import Material, SampledFrame

SPEED, UP = 3.0, 0.5
RATE = 2e4


def strain_at(x, y, at):
    """Plastic strain of material that moves and is strained at `RATE` all over."""
    x0, y0 = x - SPEED * at, y - UP * at
    return 1.0 + 0.5 * np.sin(x0 / 15e-6) * np.cos(y0 / 20e-6) + RATE * at


@dataclass(frozen=True)
class MovingBlock(Source):
    """Material that fills the upper right but a corner, and moves; some fields may be missing."""

    names: tuple[str, ...] = ("temperature", "plastic_strain", "velocity_x", "velocity_y")
    count: int = 8
    interval: float = 1e-6
    slow: float = 0.0

    def survey(self):
        return Survey(
            "made up",
            np.arange(self.count) * self.interval,
            (0.0, 120e-6, 0.0, 100e-6),
            {name: name for name in self.names},
            spacing=2e-6,
        )

    def frames(self, raster, start=0):
        x, y = np.meshgrid(raster.x, raster.y)
        solid = (x > 10e-6) & (y > 10e-6) & ~((x > 100e-6) & (y > 80e-6))
        for number in range(start, self.count):
            at = number * self.interval
            time.sleep(self.slow)
            fields = {
                "temperature": 400.0 + 1e6 * x + 5e5 * y,
                "plastic_strain": strain_at(x, y, at),
                "plastic_strain_rate": np.full(x.shape, RATE),
                "velocity_x": np.full(x.shape, SPEED),
                "velocity_y": np.full(x.shape, UP),
            }
            yield SampledFrame(
                at,
                {
                    name: np.where(solid, fields[name], np.nan).astype(np.float32)
                    for name in self.names
                },
                np.where(solid, Material.WORKPIECE, Material.VOID).astype(np.uint8),
            )


@dataclass(frozen=True)
class Broken(MovingBlock):
    """A reader that goes wrong in the third frame."""

    how: str = "crash"

    def frames(self, raster, start=0):
        for number, frame in enumerate(super().frames(raster, start)):
            if number == 2:
                self.fail()
            yield frame

    def fail(self):
        if self.how == "crash":
            os.abort()
        if self.how == "hang":
            time.sleep(1000.0)
        if self.how == "devour":
            np.ones(20_000_000_000, np.uint8)
        if self.how == "refuse":
            raise SourceError("block.vtu: frame 2 has no temperature")
        if self.how == "stumble":
            raise KeyError("offset\nof a table")
        if self.how == "chatter":
            os.write(1, b"a library's banner on standard output\n")
