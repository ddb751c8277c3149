"""Correction of measurements with the camera, emissivity and outlines of a study."""

from chipglow.camera import Measurement
from chipglow.correction import Correction, correct, joined, observed_scene, surroundings_of
from chipglow.study.running import Progress, fitted_study, silent
from chipglow.study.schema import Study
from chipglow.text import Notes


def correct_study(
    study: Study,
    measurement: Measurement,
    chip: str | None = None,
    *,
    emissivity_uncertainty: float = 0.0,
    psf_uncertainty: float = 0.0,
    outline_uncertainty: float = 0.0,
    noise: float | None = None,
    progress: Progress = silent,
) -> Correction:
    """Correct a measurement whose object is the scene of a study.

    Parameters
    ----------
    study : Study
        Camera, surface and scene. The measurement has the scene's coordinates and times.
    measurement : Measurement
        Frames within the time of the scene.
    chip : str, optional
        One of the study's surfaces; by default that which the measurement states, or the first.
    emissivity_uncertainty : float
        Standard uncertainty of the emissivity that is common to a zone.
    psf_uncertainty, outline_uncertainty, noise
        See `chipglow.correct`.
    progress : callable
        Called with the current step and its completed fraction.

    Raises
    ------
    ValueError
        If the chip is unknown, or a frame is not within the scene.

    Notes
    -----
    The emissivity is the mean of the study's surface over each exposure, without texture; its
    texture is an uncertainty of the temperature.
    """
    with fitted_study(study, progress, False) as fitted:
        surfaces, scene = fitted.surfaces, fitted.scene
        camera = study.camera.on(scene.raster, study.seed)
        stated = str(measurement.data.attrs.get("surface", next(iter(surfaces))))
        name = stated if chip is None else chip
        if name not in surfaces:
            raise ValueError(f"chip: {name!r} is unknown, expected one of {', '.join(surfaces)}")
        corrected = []
        for frame, start in enumerate(measurement.times.tolist()):
            observed = observed_scene(scene, camera, surfaces[name], start, emissivity_uncertainty)
            corrected.append(
                correct(
                    measurement.part(slice(frame, frame + 1)),
                    camera,
                    observed,
                    psf_uncertainty=psf_uncertainty,
                    outline_uncertainty=outline_uncertainty,
                    surroundings=surroundings_of(camera),
                    noise=noise,
                    seed=study.seed + frame,
                )
            )
            progress("correction", (frame + 1) / len(measurement))
    return joined(corrected).with_notes(fitted.notes + _assumed(emissivity_uncertainty))


def _assumed(uncertainty: float) -> Notes:
    if uncertainty:
        return Notes()
    return Notes(["The mean emissivity of chip and tool is exact (emissivity_uncertainty)."])
