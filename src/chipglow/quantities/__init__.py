"""Units and their text, values as tables print them, and settings declared once."""

from chipglow.quantities.format import quantity_text, rounded_text, uncertain_text
from chipglow.quantities.parameter import Parameter
from chipglow.quantities.part import (
    Family,
    FileBeside,
    Part,
    adapter,
    beside_the_study,
    of_other_packages,
    problem,
    unchecked,
)
from chipglow.quantities.settings import (
    Setting,
    changed,
    field_tables,
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
    "Part",
    "Quantity",
    "Setting",
    "adapter",
    "beside_the_study",
    "changed",
    "field_tables",
    "of_other_packages",
    "own_settings",
    "problem",
    "quantity_text",
    "rounded_text",
    "setting_at",
    "settings",
    "uncertain_text",
    "unchecked",
    "value_at",
]
