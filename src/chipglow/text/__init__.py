"""Files from outside: small text files, YAML and what it describes, HDF5 without links."""

from chipglow.text.description import (
    described_by,
    load_described,
    placed,
    validated,
)
from chipglow.text.notes import Notes
from chipglow.text.own_data import check_own_data
from chipglow.text.template import commented_yaml, json_schema
from chipglow.text.yaml_file import DescriptionError, parse_yaml, read_small_text, read_yaml

__all__ = [
    "DescriptionError",
    "Notes",
    "check_own_data",
    "commented_yaml",
    "described_by",
    "json_schema",
    "load_described",
    "parse_yaml",
    "placed",
    "read_small_text",
    "read_yaml",
    "validated",
]
