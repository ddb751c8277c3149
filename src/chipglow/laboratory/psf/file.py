"""Files of the knife edge: images of edges and apertures, and the point spread functions found."""

import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import xarray as xr

from chipglow.camera import MeasuredPSF
from chipglow.io import checked_kind, write_dataset
from chipglow.io.file_kind import MEASURED
from chipglow.laboratory.psf.edge_image import EdgeImage, counts_image, edge_image
from chipglow.laboratory.psf.knife_edge import EdgeResult, KnifeEdge, psf_kernel
from chipglow.laboratory.psf.psf_fit import ModelFit
from chipglow.laboratory.recordings import (
    Conversion,
    load_calibration,
    load_description,
    load_measurement,
    load_recording,
    measurement_of,
    repaired_signal,
)
from chipglow.quantities import FileBeside, Parameter, Part
from chipglow.quantities.units import LENGTH
from chipglow.text import DescriptionError, load_described
from chipglow.uncertainty import to_xarray


def load_edge(
    source: str | Path, settings: Iterable[str] = (), region: tuple[slice, slice] | None = None
) -> EdgeImage:
    """Read an image of an edge; counts serve without a calibration, as no temperature is needed."""
    settings, name = list(settings), Path(source).name
    if checked_kind(source, "an image of an edge", *MEASURED) == "measurement":
        return edge_image(load_measurement(source, settings), name, region)
    described = load_description(source, settings)
    recording = load_recording(described)
    if recording.quantity != "counts" or recording.conversion is not None:
        return edge_image(measurement_of(described, recording, str(source)), name, region)
    if described.calibration is not None:
        calibration = load_calibration(described.calibration)
        recording = replace(recording, band=recording.band or calibration.band)
    try:
        signal, flags = repaired_signal(recording, *Conversion(described).pixels(recording))
        return counts_image(recording, signal, flags, name, region)
    except ValueError as error:
        raise DescriptionError(f"{source}: {str(error).removeprefix(f'{name}: ')}") from error


@dataclass(frozen=True)
class ApertureSection(Part):
    """An image of a round aperture."""

    file: Annotated[FileBeside, Parameter("The measurement.")]
    diameter: Annotated[float, Parameter("Diameter of the aperture on the object.", LENGTH)]


@dataclass(frozen=True)
class ApertureList(Part):
    """Images of apertures of several diameters before one source."""

    apertures: Annotated[tuple[ApertureSection, ...], Parameter("The images.")]


def load_apertures(path: str | Path) -> list[tuple[Path, float]]:
    """Read a list of images of apertures from a YAML file."""
    found = load_described(ApertureList, path)
    return [(Path(aperture.file), aperture.diameter) for aperture in found.apertures]


def write_psf(
    knife: KnifeEdge, path: str | os.PathLike[str], psf: MeasuredPSF | None = None
) -> None:
    """Write a point spread function and what it was found from.

    Parameters
    ----------
    knife : KnifeEdge
        The result of a fit.
    path : path-like
        The file to write, for ``psf: {kind: measured, file: ...}`` of a study's camera and for
        `MeasuredPSF.from_file`.
    psf : MeasuredPSF, optional
        The kernel to write; by default the kernel of the best model (`psf_kernel`).

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    psf = psf_kernel(knife) if psf is None else psf
    data = to_xarray(psf.estimate, "kernel", ("y", "x"))
    data["kernel"].attrs |= {"spacing": psf.spacing, "includes": " ".join(psf.includes)}
    if psf.band is not None:
        data["kernel"].attrs |= {"band_lower": psf.band.lower, "band_upper": psf.band.upper}
    data = data.assign_attrs(
        fwhm=knife.fwhm,
        fwhm_uncertainty=knife.fwhm_uncertainty,
        model=knife.best.model.name,
        pitch=knife.edges[0].image.pitch,
        **knife.notes.attrs(),
    )
    for fit, weight in zip(knife.fits, knife.weights, strict=True):
        data = data.assign(_fit_variables(fit.model.name.replace(" ", "_"), fit, weight))
    for number, edge in enumerate(knife.edges, 1):
        data = data.assign(_edge_variables(f"edge{number}", edge))
    write_dataset(data, path)


def _fit_variables(name: str, fit: ModelFit, weight: float) -> dict[str, xr.Variable]:
    """Return a model's parameters, their covariance, and how well it fits."""
    about: dict[str, float | str] = {
        "parameters": ", ".join(fit.model.parameters),
        "fwhm": fit.fwhm,
        "fwhm_uncertainty": fit.fwhm_uncertainty,
        "bic": fit.bic,
        "weight": weight,
        "reduced_chi_squared": fit.reduced_chi_squared,
    }
    dimension = f"{name}_parameter"
    return {
        name: xr.Variable((dimension,), fit.values, about),
        f"{name}_covariance": xr.Variable((dimension, f"{dimension}_2"), fit.covariance),
    }


def _edge_variables(name: str, edge: EdgeResult) -> dict[str, xr.Variable]:
    """Return the edge-spread, line-spread and transfer function of one image."""
    about = {"image": edge.image.name, "fwhm": edge.fwhm, "fwhm_uncertainty": edge.fwhm_uncertainty}
    return {
        f"{name}_{column}": xr.Variable(
            (f"{name}_{curve.dims[0]}",), curve.values, {**about, **curve.attrs}
        )
        for column, curve in edge.curves.items()
    }
