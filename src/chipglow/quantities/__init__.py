"""Units and their text, values as tables print them, and settings declared once."""

from chipglow.quantities.format import quantity_text, rounded_text, uncertain_text
from chipglow.quantities.parameter import Parameter
from chipglow.quantities.part import Family, Parameters, Part, adapter, of_other_packages
from chipglow.quantities.section import FileBeside, Section, Settings, beside_the_study
from chipglow.quantities.settings import (
    Setting,
    changed,
    field_tables,
    given,
    own_settings,
    setting_at,
    settings,
    value_at,
)
from chipglow.quantities.units import ZERO_CELSIUS, Array, Quantity

__all__ = [
    "ZERO_CELSIUS",
    "Array",
    "Family",
    "FileBeside",
    "Parameter",
    "Parameters",
    "Part",
    "Quantity",
    "Section",
    "Setting",
    "Settings",
    "adapter",
    "beside_the_study",
    "changed",
    "field_tables",
    "given",
    "of_other_packages",
    "own_settings",
    "quantity_text",
    "rounded_text",
    "setting_at",
    "settings",
    "uncertain_text",
    "value_at",
]
