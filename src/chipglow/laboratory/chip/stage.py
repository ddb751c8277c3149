"""Stages of a shear band."""

from enum import StrEnum


class Stage(StrEnum):
    """Development of a shear band by its position (Heigel and Whitenton 2010, Figure 8)."""

    DEVELOPING = "developing"
    """It has not come to the reference."""
    DEVELOPED = "fully developed"
    """It is where the reference is."""
    MOVED = "moved"
    """The next segment has moved it on."""
    NONE = "no band"
    """No band is found in the frame."""
