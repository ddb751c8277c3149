"""chipglow: a virtual infrared camera for metal cutting."""

from chipglow.radiometry import Band

__all__ = ["Band"]
__version__ = "0.1.0"
