"""Small text files that people write: their limits, and YAML."""

from chipglow.text.small_file import read_small_text
from chipglow.text.yaml_file import parse_yaml, read_yaml

__all__ = ["parse_yaml", "read_small_text", "read_yaml"]
