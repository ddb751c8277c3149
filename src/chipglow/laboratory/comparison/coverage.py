"""The coverage factor of a comparison."""

from typing import Final

COVERAGE: Final = 2.0
"""Factor between standard and expanded uncertainty: about 95 %."""
