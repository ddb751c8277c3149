"""Counts of a camera of 12 bits that sees a hot chip slide along a rake face."""

import numpy as np

from chipglow.camera import Detector, EnergyResponse, ReadNoise, Recording, ShotNoise
from chipglow.radiometry import Band

BAND = Band(3.8e-6, 5.1e-6)


def chip() -> Recording:
    """Four frames."""
    y, x = np.mgrid[:120, :160] * 6e-6
    frames = []
    for number in range(4):
        along = 0.5 + 0.5 * np.cos((0.8 * x - y + 40e-6 * number) / 11e-6)
        from_face = x - 300e-6 - 0.1 * y
        solid = (from_face > 0) & (from_face < 250e-6 + 40e-6 * along)
        hot = 560 + 330 * np.exp(-from_face / 120e-6) + 70 * along
        frames.append(np.where(solid, hot, 300.0))
    detector = Detector(
        response=EnergyResponse(35.0), gain=0.02, terms=(ShotNoise(), ReadNoise(100.0))
    )
    counts = detector.counts(0.4 * BAND.radiance(np.array(frames)), np.random.default_rng(1))
    return Recording(
        counts,
        "counts",
        np.arange(4) / 600,
        camera="simulated",
        integration_time=30e-6,
        saturation=4094.0,
    )
