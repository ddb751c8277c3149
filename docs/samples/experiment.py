"""An "experiment": a scene seen with emissivities between those of the paper's two chips."""

import numpy as np

import chipglow
from chipglow.camera import CalibrationErrors, Camera, Measurement
from chipglow.scene import Scene

EXPERIMENT = chipglow.FeatureSurface(
    chip=chipglow.Emissivity(0.68, 0.04), shear_band=chipglow.Emissivity(0.56, 0.04), seed=77
)


def experiment(camera: Camera, scene: Scene, starts: np.ndarray) -> Measurement:
    """Frames with noise, a hidden error of the calibration and its stated uncertainty of 1 %."""
    clean = camera.measure(scene, EXPERIMENT, starts)
    generator = np.random.default_rng(5)
    noise = 6e-4 * clean.radiance.max() * generator.standard_normal(clean.radiance.shape)
    radiance = 1.004 * clean.radiance + noise
    assert clean.tool is not None
    return Measurement.from_radiance(
        radiance,
        clean.band,
        clean.times,
        clean.raster,
        camera.lower_limit,
        calibration_errors=CalibrationErrors(np.array([0.0, 1e6]), np.array([[0.0, 1e4]])),
    ).with_tool(clean.tool)
