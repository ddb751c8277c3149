"""The effects between a scene and a reading: one vocabulary, in the order of the light."""

from enum import StrEnum
from typing import Final


class Effect(StrEnum):
    """Cause of a difference between the reading of a camera and the true temperature.

    The members are in the order in which the light meets the effects, and are texts, so that YAML,
    tables and files use the same names.
    """

    EMISSIVITY = "emissivity"
    """The surface emits less than a blackbody; switched off, its emissivity is 1."""
    REFLECTION = "reflection"
    """Light from surroundings and other surfaces; switched off, there is none."""
    MOTION = "motion"
    """The mean over the integration time; switched off, the scene stands still."""
    PSF = "psf"
    """The point spread function."""
    OPTICS = "optics"
    """Further terms of the optics, such as a veil."""
    FOOTPRINT = "footprint"
    """The mean over a pixel's sensitive square; switched off, one sample of it."""
    MISREGISTRATION = "misregistration"
    """Two channels look at different places."""
    DELAY = "delay"
    """Two channels look at different times."""
    DETECTOR = "detector"
    """The detector's terms, such as noise."""
    DIGITISER = "digitiser"
    """Full well, saturation and rounding to counts."""


EVERY: Final = frozenset(Effect)
"""All effects: what a camera reads."""


def joined(effects: frozenset[str]) -> str:
    """Return the name of several effects that act as one, such as ``psf and footprint``."""
    return " and ".join(one.value for one in Effect if one in effects)
