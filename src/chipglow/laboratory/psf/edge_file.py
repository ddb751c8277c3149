"""Images of edges and apertures as the laboratory's commands take them."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from chipglow.io import is_measurement, is_scene
from chipglow.laboratory.measurement import (
    load_calibration,
    load_description,
    load_measurement,
    load_recording,
    measurement_of,
    pixel_correction,
    repaired_signal,
)
from chipglow.laboratory.psf.edge_image import EdgeImage, counts_image, edge_image
from chipglow.quantities import FileBeside, Parameter, Section
from chipglow.quantities.units import LENGTH
from chipglow.text import DescriptionError, load_described


def load_edge(
    source: str | Path, settings: Iterable[str] = (), region: tuple[slice, slice] | None = None
) -> EdgeImage:
    """Read an image of an edge: a measurement, or a camera's file with or without a calibration.

    Counts serve as they are, as an edge needs no more than a straight line over the radiance. A
    calibration holds beyond its range, as the edge needs no temperature.
    """
    settings, name = list(settings), Path(source).name
    if is_measurement(source) or is_scene(source):
        return edge_image(load_measurement(source, settings), name, region)
    described = load_description(source, settings)
    recording = load_recording(described)
    if recording.quantity != "counts" or recording.conversion is not None:
        return edge_image(measurement_of(described, recording, str(source)), name, region)
    if described.calibration is not None:
        calibration = load_calibration(described.calibration)
        recording = replace(recording, band=recording.band or calibration.band)
    try:
        corrected = pixel_correction(described, recording)
        signal, flags = repaired_signal(recording, *corrected)
        return counts_image(recording, signal, flags, name, region)
    except ValueError as error:
        raise DescriptionError(f"{source}: {str(error).removeprefix(f'{name}: ')}") from error


class ApertureSection(Section):
    """An image of a round aperture."""

    file: Annotated[FileBeside, Parameter("The measurement.")]
    diameter: Annotated[float, Parameter("Diameter of the aperture on the object.", LENGTH)]


class ApertureList(Section):
    """Images of apertures of several diameters before one source."""

    apertures: Annotated[tuple[ApertureSection, ...], Parameter("The images.")]


def load_apertures(path: str | Path) -> list[tuple[Path, float]]:
    """Read a list of images of apertures from a YAML file."""
    found = load_described(ApertureList, path)
    return [(Path(aperture.file), aperture.diameter) for aperture in found.apertures]
