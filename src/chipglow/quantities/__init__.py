"""Units and their text, values as tables print them, and fields declared once."""

from chipglow.quantities.field_tables import FieldEntry, field_entries, field_tables
from chipglow.quantities.format import quantity_text, rounded_text, uncertain_text
from chipglow.quantities.part import (
    Declared,
    Family,
    Parameter,
    Parameters,
    Part,
    Settings,
    of_other_packages,
)
from chipglow.quantities.section import (
    OR_NONE,
    FileBeside,
    OrWord,
    Section,
    allowed,
    beside_the_study,
    described,
)
from chipglow.quantities.units import Quantity

__all__ = [
    "OR_NONE",
    "Declared",
    "Family",
    "FieldEntry",
    "FileBeside",
    "OrWord",
    "Parameter",
    "Parameters",
    "Part",
    "Quantity",
    "Section",
    "Settings",
    "allowed",
    "beside_the_study",
    "described",
    "field_entries",
    "field_tables",
    "of_other_packages",
    "quantity_text",
    "rounded_text",
    "uncertain_text",
]
