"""Defaults that follow from feed, rake angle, speed and exposure: view, window, cutting length."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import ceil, degrees, tan
from typing import Any, Final

from chipglow.cutting import OutputWindow
from chipglow.quantities.units import InSI
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


VIEWS: Final = ("window", "field_of_view")
"""Parts of the section cutting with derived settings."""

DERIVED: Final = (
    "camera.pitch",
    "camera.psf",
    "camera.psf_order",
    "camera.lower_limit",
    "cutting.cutting_length",
    *(f"cutting.window.{name}" for name in ("start", "end", "interval", "band_duration")),
    *(f"cutting.field_of_view.{name}" for name in ("left", "top", "spacing", "rows", "columns")),
)
"""Settings that follow from others."""


def without(data: Mapping[str, Any], paths: Iterable[str]) -> dict[str, Any]:
    """Return nested data without the settings at some paths."""
    left = dict(data)
    for path in paths:
        name, dot, rest = path.partition(".")
        if dot and isinstance(left.get(name), Mapping):
            left[name] = without(left[name], [rest])
        elif not dot:
            left.pop(name, None)
    return left


def scaled(study: Mapping[str, Any], from_file: bool = True) -> dict[str, Any]:
    """Return a study's data with the defaults that follow from its feed, speed and camera."""
    cutting, camera = (study.get(name) or {} for name in ("cutting", "camera"))
    if study.get("scene", "none") not in ("none", None) or not isinstance(cutting, Mapping):
        return dict(study)
    window, view, tool = (cutting.get(name) or {} for name in ("window", "field_of_view", "tool"))
    if not all(isinstance(one, Mapping) for one in (camera, window, view, tool)):
        return dict(study)
    try:
        numbers = _Numbers.read(cutting, window, view, tool, camera, from_file)
    except ValueError:  # which reading the field reports
        return dict(study)
    inner = {
        "window": {**numbers.window(), **window},
        "field_of_view": {**numbers.field_of_view(), **view},
    }
    filled = {name: section for name, section in inner.items() if section}
    return {**study, "cutting": {**numbers.cutting(), **cutting, **filled}}


@dataclass(frozen=True)
class _Numbers:
    """Numbers of a study in SI units from which others follow."""

    ratio: float
    """Feed relative to the paper's."""
    speed: float
    exposure: float
    rake: float
    start: float
    end: float
    spacing: float

    @classmethod
    def read(
        cls,
        cutting: Mapping[str, Any],
        window: Mapping[str, Any],
        view: Mapping[str, Any],
        tool: Mapping[str, Any],
        camera: Mapping[str, Any],
        from_file: bool,
    ) -> "_Numbers":
        """Read them from a study's data; a ValueError if a number is impossible."""
        camera = CameraSection.with_pitch(camera, from_file)
        exposure = CameraSection.number(camera, "integration_time", from_file)
        speed = CuttingSection.number(cutting, "speed", from_file)
        ratio = CuttingSection.number(cutting, "feed", from_file) / CuttingSection.feed
        start = OutputWindow.number(window, "start", from_file, ratio * OutputWindow.start)
        travel = max(ratio * _TRAVEL, _EXPOSURES * exposure * speed)
        pitch = CameraSection.number(camera, "pitch", from_file)
        return cls(
            ratio=ratio,
            speed=speed,
            exposure=exposure,
            rake=CutToolSection.number(tool, "rake_angle", from_file),
            start=start,
            end=OutputWindow.number(window, "end", from_file, start + travel),
            spacing=FieldOfViewSection.number(view, "spacing", from_file, pitch / _ACROSS),
        )

    @property
    def _moves_window(self) -> bool:
        return self.ratio != 1.0 or self.exposure * self.speed > _TRAVEL

    def cutting(self) -> dict[str, Any]:
        """Return the cutting length, if it is not the paper's."""
        if not self._moves_window:
            return {}
        length = max(self.ratio * CuttingSection.cutting_length, _AFTER_WINDOW * self.end)
        return {"cutting_length": InSI(length)}

    def window(self) -> dict[str, Any]:
        """Return the settings of the window that are not the paper's."""
        derived: dict[str, Any] = {}
        if self._moves_window:
            derived |= {"start": InSI(self.start), "end": InSI(self.end)}
        slower = CuttingSection.speed / self.speed
        if self.ratio != 1.0 or slower != 1.0:
            interval = self.ratio * slower * OutputWindow.interval
            derived["interval"] = InSI(min(interval, self.exposure / _SUB_FRAMES))
        if self.exposure > OutputWindow.band_duration:
            derived["band_duration"] = InSI(self.exposure)
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
            "left": InSI(self.ratio * left),
            "top": InSI(self.ratio * top),
            "spacing": InSI(self.spacing),
            "rows": ceil(self.ratio * (top - _BOTTOM) / self.spacing - _ROUNDING),
            "columns": ceil(self.ratio * width / self.spacing - _ROUNDING),
        }


_TRAVEL: Final = OutputWindow.end - OutputWindow.start
"""Cutting length in m in the paper's window."""
