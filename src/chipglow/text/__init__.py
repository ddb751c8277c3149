"""Small text files that people write: their limits, YAML, and what a YAML file describes."""

from chipglow.text.description import (
    DescriptionError,
    described_by,
    load_described,
    placed,
    problem,
    read_description,
    validated,
)
from chipglow.text.notes import Notes
from chipglow.text.small_file import read_small_text
from chipglow.text.template import commented_yaml, json_schema
from chipglow.text.yaml_file import parse_yaml, read_yaml

__all__ = [
    "DescriptionError",
    "Notes",
    "commented_yaml",
    "described_by",
    "json_schema",
    "load_described",
    "parse_yaml",
    "placed",
    "problem",
    "read_description",
    "read_small_text",
    "read_yaml",
    "validated",
]
