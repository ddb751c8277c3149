"""The Jinja2 environment of the report: its page, and the texts in YAML."""

import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from math import isfinite
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup, escape

from chipglow.drawing.drawing import data_url, png
from chipglow.quantities.format import quantity_text, readable
from chipglow.report.shown_units import in_unit
from chipglow.text import parse_yaml

_IMPORT: Final = '{% from "sentences.txt" import gaussian_widths, main_cause, wings with context %}'
_BEFORE_UNIT: Final = re.compile(r"(?<=\d) (?=[°%µ]|[KN]\b|mm\b|1/s)|(?<=±) | (?=±)")


@cache
def texts(name: str = "texts") -> Mapping[str, Any]:
    """Return the templates of all texts, or of those about the paper."""
    text = files("chipglow.report").joinpath(f"{name}.yaml").read_text(encoding="utf-8")
    parsed: Mapping[str, Any] = parse_yaml(text)
    return parsed


@cache
def template(text: str) -> Template:
    """Return the template of a text."""
    return environment().from_string(f"{_IMPORT}{text}" if "{" in text else text)


@cache
def environment() -> Environment:
    """Return the environment; it escapes text on the page only."""
    made = Environment(
        loader=PackageLoader("chipglow.report"),
        autoescape=lambda name: name == "report.html",
        undefined=StrictUndefined,
    )
    made.filters |= {
        "data_url": lambda image: data_url(png(image)),
        "bare": _bare,
        "in_unit": _in_unit,
        "number": _number,
        "shown": _shown,
        "um": lambda length: f"{length * 1e6:.3g} µm" if isfinite(length) else "of unknown length",
    }
    made.tests["known"] = isfinite
    made.tests["numeric"] = lambda text: any(map(str.isdigit, text))
    return made


def _number(value: float, unit: str, decimals: int = 0) -> str:
    """Return a number that is in its unit already."""
    number = float(value)
    return quantity_text(number, unit, decimals) if isfinite(number) else "an unknown value"


def _in_unit(value: float, unit: str, decimals: int = 0) -> str:
    """Return a value in SI as a number with its unit."""
    return _number(in_unit(value, unit), unit, decimals)


def _bare(value: float, unit: str) -> str:
    """Return a value in SI as a number in a unit, without the unit."""
    return f"{in_unit(value, unit):g}".replace("-", "−")


def _shown(text: str) -> Markup:
    """Escape a text with µm, µs and °C, and keep each number on one line with its unit."""
    return Markup(_BEFORE_UNIT.sub("\u00a0", str(escape(readable(text)))))
