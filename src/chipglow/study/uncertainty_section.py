"""The section of the uncertainty: input quantities of a budget by the paths of their settings."""

from dataclasses import dataclass, field, replace
from math import inf
from statistics import pstdev
from typing import Annotated, Any, Final

from chipglow.quantities import Parameter, Part, setting_at
from chipglow.quantities.units import is_bare_number
from chipglow.uncertainty import Input, Inputs
from chipglow.uncertainty.component import HALF_WIDTHS, DistributionKind
from chipglow.uncertainty.inputs import InputDistributionKind

_SECTIONS: Final = ("camera", "surface", "cutting")


@dataclass(frozen=True)
class InputSection(Part):
    """Distribution of one setting about its value in the study.

    Widths and values are texts in the setting's unit or relative to its value, which is known only
    with the study; an `Input` has their numbers.
    """

    standard: Annotated[
        float | str | None,
        Parameter("Standard uncertainty, in the setting's unit (0.5 um) or relative (3 %)."),
    ] = None
    half_width: Annotated[
        float | str | None,
        Parameter("Half-width of a rectangular, triangular or arcsine distribution, likewise."),
    ] = None
    values: Annotated[
        tuple[float | str, ...], Parameter("Values of equal probability instead, or [].")
    ] = ()
    distribution: Annotated[
        DistributionKind | None,
        Parameter("Distribution. Default: normal; rectangular with a half-width."),
    ] = None
    degrees_of_freedom: Annotated[
        float | None, Parameter("Degrees of freedom of a standard uncertainty.", over=0.0)
    ] = None
    group: Annotated[
        str | None,
        Parameter("Group whose part of the variance is stated. Default: the setting's section."),
    ] = None
    source: Annotated[str, Parameter("Source of the uncertainty.")] = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        stated = [self.standard is not None, self.half_width is not None, bool(self.values)]
        if sum(stated) != 1:
            raise ValueError("must have one of standard, half_width and values")
        if self.half_width is not None and self.distribution == "normal":
            raise ValueError(
                "half_width: requires a rectangular, triangular or arcsine distribution"
            )
        if self.values and self.distribution:
            raise ValueError("distribution: cannot be combined with values")
        if self.degrees_of_freedom and self.distribution_used != "normal":
            raise ValueError("degrees_of_freedom: requires a standard uncertainty that is normal")

    @property
    def distribution_used(self) -> InputDistributionKind:
        """Distribution; if it is not stated, normal, rectangular or discrete."""
        if self.values:
            return "discrete"
        return self.distribution or ("normal" if self.half_width is None else "rectangular")


@dataclass(frozen=True)
class UncertaintySection(Part):
    """Input quantities of the uncertainty budget."""

    inputs: Annotated[
        dict[str, InputSection],
        Parameter(
            "Inputs by the path of a setting of camera, surface or cutting.",
            allowed="{} or paths: {camera.pitch: {standard: 0.1 um, source: grid}, surface.tool."
            "mean: {half_width: 0.05}}",
        ),
    ] = field(default_factory=dict)
    correlations: Annotated[
        tuple[tuple[str, str, float], ...],
        Parameter(
            "Correlation coefficients of two inputs of a group.",
            allowed="[] or such as [[camera.pitch, camera.psf.fwhm, 0.4]]",
        ),
    ] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        for path in self.inputs:
            if path.partition(".")[0] not in _SECTIONS:
                raise ValueError(f"inputs: {path!r}, expected a path in {', '.join(_SECTIONS)}")

    def build(self, study: Part) -> Inputs:
        """Return the inputs with the study's values as best estimates, in SI."""
        built = []
        for path, one in self.inputs.items():
            try:
                setting = setting_at(study, path)
            except LookupError:
                raise ValueError(f"uncertainty.inputs: {path}: no such setting") from None
            if isinstance(setting.value, bool) or not isinstance(setting.value, int | float):
                raise ValueError(
                    f"uncertainty.inputs: {path}: is {setting.plain!r}, expected a number"
                )
            try:
                built.append(_input(path, one, float(setting.value), setting.parameter))
            except ValueError as error:
                text = str(error).removeprefix(f"{path}: ")
                raise ValueError(f"uncertainty.inputs: {path}: {text}") from None
        try:
            return Inputs(built, self.correlations)
        except ValueError as error:
            raise ValueError(f"uncertainty.{error}") from None


def _input(path: str, one: InputSection, value: float, parameter: Parameter) -> Input:
    given: dict[str, Any] = {
        "name": path,
        "value": value,
        "distribution": one.distribution_used,
        "group": one.group or path.split(".")[0],
        "unit": parameter.quantity.base if parameter.quantity else "1",
    }
    if one.values:
        values = tuple(parameter.number(each) for each in one.values)
        return Input(**given, standard_uncertainty=pstdev(values), values=values)
    stated = one.standard if one.half_width is None else one.half_width
    width = _size(stated, value, parameter)
    if one.half_width is not None:
        width /= HALF_WIDTHS[one.distribution_used]
    low, high = parameter.extent
    freedom = one.degrees_of_freedom or inf
    return Input(
        **given, standard_uncertainty=width, degrees_of_freedom=freedom, low=low, high=high
    )


def _size(stated: object, value: float, parameter: Parameter) -> float:
    """Return a positive width in SI, of a text in the setting's unit or relative to its value."""
    text, quantity = str(stated).strip(), parameter.quantity
    if text.endswith("%"):
        if quantity is not None and quantity.base == "K" and not quantity.is_difference:
            raise ValueError(
                f"{text!r} of a temperature depends on its unit, expected a difference such as 2 K"
            )
        size = abs(value) * _number(text[:-1], text, "a percentage such as 3 %") / 100
    elif quantity is not None:
        size = replace(quantity, positive=False, is_difference=True).parse(stated)
    else:
        size = _number(text, text, "a number without a unit, or a percentage such as 3 %")
    if not 0 < size < inf:
        zero = f" of {value:g}" if text.endswith("%") and not value else ""
        raise ValueError(f"{text!r}{zero}, expected more than 0")
    return size


def _number(text: str, whole: str, expected: str) -> float:
    if not is_bare_number(text):
        raise ValueError(f"{whole!r}, expected {expected}")
    return float(text.replace("−", "-"))
