"""Point spread functions by the knife edge in NetCDF-4 files."""

import os

import xarray as xr

from chipglow.camera import MeasuredPSF
from chipglow.io import write_dataset
from chipglow.laboratory.psf.kernel import psf_kernel
from chipglow.laboratory.psf.knife_edge import EdgeResult, KnifeEdge
from chipglow.laboratory.psf.psf_fit import ModelFit
from chipglow.uncertainty import to_xarray


def write_psf(
    knife: KnifeEdge, path: str | os.PathLike[str], psf: MeasuredPSF | None = None
) -> None:
    """Write a point spread function and what it was found from.

    Parameters
    ----------
    knife : KnifeEdge
        What was found.
    path : path-like
        The file to write, for ``psf: {kind: measured, file: ...}`` of a study's camera and for
        `MeasuredPSF.from_file`; one that is there is replaced at the end.
    psf : MeasuredPSF, optional
        The kernel to write, with the components of its uncertainty; by default that of the best
        model, as `psf_kernel` makes it.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    psf = psf_kernel(knife) if psf is None else psf
    data = to_xarray(psf.estimate, "kernel", ("y", "x"))
    data["kernel"].attrs |= {"spacing": psf.spacing, "includes": " ".join(psf.includes)}
    data = data.assign_attrs(
        fwhm=knife.fwhm,
        fwhm_uncertainty=knife.fwhm_uncertainty,
        model=knife.best.model.name,
        **knife.notes.attrs(),
    )
    for fit, weight in zip(knife.fits, knife.weights, strict=True):
        data = data.assign(_fit_variables(fit.model.name.replace(" ", "_"), fit, weight))
    for number, edge in enumerate(knife.edges, 1):
        data = data.assign(_edge_variables(f"edge{number}", edge))
    radial, encircled = knife.radial, knife.radial.encircled
    data = data.assign(
        radius=("ring", radial.radius, {"units": "m"}),
        density=("ring", radial.density, {"units": "m-2"}),
        encircled_radius=("ring_edge", radial.edges, {"units": "m"}),
        encircled=("ring_edge", encircled.values, {"units": "1"}),
        encircled_uncertainty=("ring_edge", encircled.standard_uncertainty, {"units": "1"}),
    )
    write_dataset(data, path)


def _fit_variables(name: str, fit: ModelFit, weight: float) -> dict[str, xr.Variable]:
    """A model's parameters, their covariance, and how well it fits."""
    about: dict[str, float | str] = {
        "parameters": ", ".join(fit.model.parameters),
        "fwhm": fit.fwhm,
        "fwhm_uncertainty": fit.fwhm_uncertainty,
        "aicc": fit.aicc,
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
    """Edge-spread, line-spread and transfer function of one image."""
    about = {"image": edge.image.name, "fwhm": edge.fwhm, "fwhm_uncertainty": edge.fwhm_uncertainty}
    return {
        f"{name}_{column}": xr.Variable(
            (f"{name}_{curve.dims[0]}",), curve.values, {**about, **curve.attrs}
        )
        for column, curve in edge.curves.items()
    }
