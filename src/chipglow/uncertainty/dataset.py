"""Estimates as datasets with the attributes of obsarray, which punpy reads.

Conventions: obsarray's user guide, "Storing uncertainties" (https://obsarray.readthedocs.io). A
variable names its uncertainty variables in ``unc_comps``; each of these states for every dimension
whether its errors are ``random`` or ``systematic``, and keeps the sign of the effect: the
covariance of a systematic one is the product of its values. Everything without an attribute in
obsarray (cause, identity, degrees of freedom, warnings) is in attributes of ours.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, cast

import numpy as np
import xarray as xr
from scipy import sparse

from chipglow.quantities import Array
from chipglow.uncertainty.component import Cause, Component, DistributionKind
from chipglow.uncertainty.estimate import Estimate, factor

_MOST_ERRORS: Final = 1000
"""Most errors of a component that values share in a file."""

_SHAPES: Final = {"normal": "gaussian"}
_DISTRIBUTIONS: Final[Mapping[str, DistributionKind]] = {
    "gaussian": "normal",
    "uniform": "rectangular",
}

_RANDOM, _SYSTEMATIC, _MATRIX = "random", "systematic", "err_corr_matrix"


def to_xarray(
    estimate: Estimate, name: str, dims: Sequence[str] | None = None, units: str = "1"
) -> xr.Dataset:
    """Return values and components as variables of a dataset; those of several can be merged.

    A component of over 1000 errors, such as those of all pixels in a mean, is refused.
    """
    dims = [f"dim_{n}" for n in range(estimate.values.ndim)] if dims is None else list(dims)
    if len(dims) != estimate.values.ndim:
        raise ValueError(
            f"{name}: has {len(dims)} dimensions named, expected {estimate.values.ndim}"
        )
    variables: dict[str, Any] = {}
    for component in estimate.components:
        for values, attributes in _parts(component):
            values = values.reshape(estimate.shape)
            label = _label(attributes, name, variables)
            forms = correlation_forms(dict.fromkeys(dims, attributes.pop("form")))
            variables[label] = (dims, values, {"units": units, **attributes, **forms})
    attributes = {"units": units, "unc_comps": list(variables)}
    for key in ("unevaluated", "warnings"):
        if getattr(estimate, key):
            attributes[key] = list(getattr(estimate, key))
    return xr.Dataset({name: (dims, estimate.values, attributes), **variables})


def from_xarray(data: xr.Dataset, name: str) -> Estimate:
    """Read an estimate from a dataset of `to_xarray` or of obsarray.

    Correlations are random or systematic along each dimension or, along all together, a matrix.
    """
    if name not in data:
        raise ValueError(f"{name}: there is no such variable, expected one of {list(data)}")
    variable = data[name]
    causes: dict[Cause, dict[int, Any]] = {}
    for label in _texts(variable.attrs.get("unc_comps", ())):
        if label not in data:
            raise ValueError(f"{name}: its uncertainty {label} is missing")
        cause, error, effects = _read(data, variable, label)
        causes.setdefault(cause, {})[error] = effects
    components = [
        Component(cause, np.concatenate([parts[n] for n in sorted(parts)], axis=1))
        if len(parts) > 1
        else Component(cause, *parts.values())
        for cause, parts in causes.items()
    ]
    remarks = (_texts(variable.attrs.get(key, ())) for key in ("unevaluated", "warnings"))
    return Estimate(variable.values, tuple(components), *remarks)


def _parts(component: Component) -> Iterator[tuple[Array, dict[str, Any]]]:
    """Yield values and attributes of the uncertainty variables of a component."""
    if component.per_element:
        yield component.effects.diagonal(), {**_attributes(component.cause, 0), "form": _RANDOM}
        return
    effects, errors = component.effects, component.cause.errors
    if errors > _MOST_ERRORS:
        raise ValueError(
            f"component {component.cause.name}: {errors} errors that values share, expected "
            f"{_MOST_ERRORS} or fewer in a file"
        )
    for error, column in enumerate((effects.toarray() if sparse.issparse(effects) else effects).T):
        yield column, {**_attributes(component.cause, error), "form": _SYSTEMATIC}


def _attributes(cause: Cause, error: int) -> dict[str, Any]:
    return {
        "pdf_shape": _SHAPES.get(cause.distribution, cause.distribution),
        "cause": cause.name,
        "identity": cause.identity,
        "error": error,
        "errors": cause.errors,
        "degrees_of_freedom": cause.degrees_of_freedom,
        "pooled": int(cause.pooled),
        **({"parts": list(cause.parts)} if cause.parts else {}),
    }


def _label(attributes: Mapping[str, Any], name: str, others: Mapping[str, Any]) -> str:
    """Return a name of an uncertainty variable that no other has."""
    label = f"u_{re.sub(r'[^0-9A-Za-z]+', '_', attributes['cause'])}_{name}"
    count = sum(other == label or other.startswith(f"{label}_") for other in others)
    return f"{label}_{count + 1}" if count else label


def correlation_forms(forms: Mapping[str, str]) -> dict[str, Any]:
    """Return the attributes of obsarray for the correlation of errors along dimensions."""
    attributes: dict[str, Any] = {}
    for number, (dim, form) in enumerate(forms.items(), 1):
        start = f"err_corr_{number}"
        attributes |= {f"{start}_dim": dim, f"{start}_form": form}
        attributes |= {f"{start}_params": [], f"{start}_units": []}
    return attributes


def _read(data: xr.Dataset, variable: xr.DataArray, label: str) -> tuple[Cause, int, Any]:
    """Return cause, number of the error, and effects of an uncertainty variable."""
    part = data[label]
    values = np.broadcast_to(part.values, variable.shape).astype(np.float64)
    if part.attrs.get("units") == "%":
        values = values / 100 * variable.values
    effects, own = _effects(data, part, label, values.ravel())
    attributes, shape = part.attrs, str(part.attrs.get("pdf_shape", "gaussian"))
    cause = Cause(
        str(attributes.get("cause", label)),
        # A dataset of obsarray says nothing of other variables: its errors are its own.
        str(attributes.get("identity", f"{label} of {variable.name}")),
        int(attributes.get("errors", effects.shape[1])),
        float(attributes.get("degrees_of_freedom", np.inf)),
        bool(attributes.get("pooled", not own)),
        _texts(attributes.get("parts", ())),
        _DISTRIBUTIONS.get(shape, cast("DistributionKind", shape)),
    )
    return cause, int(attributes.get("error", 0)), effects


def _effects(data: xr.Dataset, part: xr.DataArray, label: str, values: Array) -> tuple[Any, bool]:
    """Return the effects of an uncertainty variable, and whether they are random."""
    form = dict.fromkeys(part.dims, _RANDOM)
    params: tuple[str, ...] = ()
    for key, dims in part.attrs.items():
        if re.fullmatch(r"err_corr_\w+_dim", key):
            start = key.removesuffix("_dim")
            form |= dict.fromkeys(_texts(dims), part.attrs[f"{start}_form"])
            params += _texts(part.attrs.get(f"{start}_params", ()))
    forms = set(form.values())
    if forms == {_MATRIX} and len(params) == 1:
        return values[:, None] * factor(data[params[0]].values, label), False
    if not forms <= {_RANDOM, _SYSTEMATIC}:
        raise ValueError(
            f"{label}: its errors correlate as {', '.join(sorted(forms))}, expected random or "
            "systematic along each dimension, or one matrix along all"
        )
    if _RANDOM not in forms:
        return values[:, None], False
    sizes = [part.sizes[dim] if form[dim] == _RANDOM else 1 for dim in part.dims]
    numbers = np.broadcast_to(np.arange(np.prod(sizes)).reshape(sizes), part.shape).ravel()
    places = (values, numbers, np.arange(values.size + 1))
    return sparse.csr_array(places, shape=(values.size, int(np.prod(sizes)))), True


def _texts(value: Any) -> tuple[str, ...]:
    """Return the texts of an attribute: a list of one comes back from a file as a text."""
    return (value,) if isinstance(value, str) else tuple(str(text) for text in value)
