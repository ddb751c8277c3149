"""Defaults that follow from feed, rake angle, speed and exposure: view, window, cutting length."""

from dataclasses import dataclass
from math import ceil, degrees, tan
from typing import Any, Final

from chipglow.cutting import OutputWindow
from chipglow.quantities import rederived
from chipglow.study.camera_section import CameraSection
from chipglow.study.cutting_section import CuttingSection, CutToolSection, FieldOfViewSection

_RIGHT, _BOTTOM = 40e-6, -80e-6
"""Right and lower edge of the paper's view in m."""

_LEFT_A_DEGREE, _TOP_A_DEGREE = 6e-6, 15e-6
"""The chip is thicker and its contact longer by so much for each degree below the paper's rake."""

_ACROSS: Final = 9
"""Samples along a pixel, as in the paper."""

_EXPOSURES: Final = 3.0
"""Number of exposures in a lengthened window."""

_SUB_FRAMES: Final = 10
"""Frames that an exposure has at least."""

_AFTER_WINDOW: Final = 1.05
"""Cutting length relative to the end of the window, at least."""

_ROUNDING: Final = 1e-6
"""Part of a sample by which a view may exceed a whole number of them."""


def resolved(cutting: CuttingSection, camera: CameraSection) -> CuttingSection:
    """Return a study's section cutting with the settings that follow from others.

    They are those that were not given of the window, the field of view, and the cutting length.
    """
    numbers = _Numbers.of(cutting, camera)
    made = rederived(cutting, **numbers.cutting())
    for name, values in (("window", numbers.window()), ("field_of_view", numbers.field_of_view())):
        try:
            section = rederived(getattr(cutting, name), **values)
        except ValueError as error:
            raise ValueError(f"{name}.{error}") from None
        object.__setattr__(made, name, section)
    return made


@dataclass(frozen=True)
class _Numbers:
    """Independent settings of a study in SI units, from which others follow."""

    ratio: float
    """Feed relative to the paper's."""
    speed: float
    exposure: float
    rake: float
    start: float
    end: float
    spacing: float

    @classmethod
    def of(cls, cutting: CuttingSection, camera: CameraSection) -> "_Numbers":
        """Return the numbers of a study's sections."""
        window, view, exposure = cutting.window, cutting.field_of_view, camera.integration_time
        ratio = cutting.feed / CuttingSection.feed
        start = window.start if "start" in window.given else ratio * OutputWindow.start
        travel = max(ratio * _TRAVEL, _EXPOSURES * exposure * cutting.speed)
        return cls(
            ratio=ratio,
            speed=cutting.speed,
            exposure=exposure,
            rake=cutting.tool.rake_angle,
            start=start,
            end=window.end if "end" in window.given else start + travel,
            spacing=view.spacing if "spacing" in view.given else camera.pitch / _ACROSS,
        )

    @property
    def _moves_window(self) -> bool:
        return self.ratio != 1.0 or self.exposure * self.speed > _TRAVEL

    def cutting(self) -> dict[str, Any]:
        """Return the cutting length, if it is not the paper's."""
        if not self._moves_window:
            return {}
        length = max(self.ratio * CuttingSection.cutting_length, _AFTER_WINDOW * self.end)
        return {"cutting_length": length}

    def window(self) -> dict[str, Any]:
        """Return the settings of the window that are not the paper's."""
        derived: dict[str, Any] = {}
        if self._moves_window:
            derived |= {"start": self.start, "end": self.end}
        slower = CuttingSection.speed / self.speed
        if self.ratio != 1.0 or slower != 1.0:
            interval = self.ratio * slower * OutputWindow.interval
            derived["interval"] = min(interval, self.exposure / _SUB_FRAMES)
        if self.exposure > OutputWindow.band_duration:
            derived["band_duration"] = self.exposure
        return derived

    def field_of_view(self) -> dict[str, Any]:
        """Return the view, if it is not the paper's."""
        if self.ratio == 1.0 and self.rake == CutToolSection.rake_angle:
            return {}
        below = max(degrees(CutToolSection.rake_angle - self.rake), 0.0)
        left = FieldOfViewSection.left - below * _LEFT_A_DEGREE
        top = FieldOfViewSection.top + below * _TOP_A_DEGREE
        width = max(_RIGHT, top * tan(self.rake) + _RIGHT) - left
        return {
            "left": self.ratio * left,
            "top": self.ratio * top,
            "spacing": self.spacing,
            "rows": ceil(self.ratio * (top - _BOTTOM) / self.spacing - _ROUNDING),
            "columns": ceil(self.ratio * width / self.spacing - _ROUNDING),
        }


_TRAVEL: Final = OutputWindow.end - OutputWindow.start
"""Cutting length in m in the paper's window."""
