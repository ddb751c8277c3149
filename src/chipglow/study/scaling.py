"""Defaults that follow from feed, rake angle, speed and exposure: view, window, cutting length."""

from collections.abc import Iterable, Mapping
from math import ceil, degrees, radians, tan
from typing import Any, Final

from chipglow.quantities.units import ANGLE, CUT_LENGTH, LENGTH, POSITION, SPEED, TIME, Quantity

_FEED, _SPEED, _PITCH, _EXPOSURE = 0.3e-3, 250 / 60, 6e-6, 10e-6
_RAKE: Final = radians(-7.0)
_START, _END, _LENGTH = 1.579e-3, 1.958e-3, 2.6e-3
_LEFT, _RIGHT, _BOTTOM, _TOP = -650e-6, 40e-6, -80e-6, 700e-6
_LEFT_A_DEGREE, _TOP_A_DEGREE = 6e-6, 15e-6
"""The chip is thicker and its contact longer by so much for each degree below the paper's rake."""

_INTERVAL, _BAND = 0.2e-6, 10e-6
_ACROSS: Final = 9
"""Samples along a pixel, as in the paper."""

_EXPOSURES: Final = 3.0
"""Number of exposures in a lengthened window."""

_SUB_FRAMES: Final = 10
"""Frames that an exposure has at least."""


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

    def value(section: Mapping[str, Any], name: str, quantity: Quantity, default: float) -> float:
        return quantity.parse(section[name], si=not from_file) if name in section else default

    try:
        camera = with_pitch(camera, from_file)
        exposure = value(camera, "integration_time", TIME, _EXPOSURE)
        speed = value(cutting, "speed", SPEED, _SPEED)
        ratio = value(cutting, "feed", CUT_LENGTH, _FEED) / _FEED
        start = value(window, "start", CUT_LENGTH, ratio * _START)
        travel = max(ratio * (_END - _START), _EXPOSURES * exposure * speed)
        end = value(window, "end", CUT_LENGTH, start + travel)
        pitch = value(camera, "pitch", LENGTH, _PITCH)
        spacing = value(view, "spacing", LENGTH, pitch / _ACROSS)
        rake = value(tool, "rake_angle", ANGLE, _RAKE)
    except ValueError:
        return dict(study)
    slower = _SPEED / speed
    length: dict[str, Any] = {}
    times: dict[str, Any] = {}
    grid: dict[str, Any] = {}
    if ratio != 1.0 or exposure * speed > _END - _START:
        times |= {"start": CUT_LENGTH.text(start), "end": CUT_LENGTH.text(end)}
        length = {"cutting_length": CUT_LENGTH.text(max(ratio * _LENGTH, 1.05 * end))}
    if ratio != 1.0 or slower != 1.0:
        times["interval"] = TIME.text(min(ratio * slower * _INTERVAL, exposure / _SUB_FRAMES))
    if exposure > _BAND:
        times["band_duration"] = TIME.text(exposure)
    if ratio != 1.0 or rake != _RAKE:
        below = max(degrees(_RAKE - rake), 0.0)
        left, top = _LEFT - below * _LEFT_A_DEGREE, _TOP + below * _TOP_A_DEGREE
        width = max(_RIGHT, top * tan(rake) + _RIGHT) - left
        grid = {
            "left": POSITION.text(ratio * left),
            "top": POSITION.text(ratio * top),
            "spacing": LENGTH.text(spacing),
            "rows": ceil(ratio * (top - _BOTTOM) / spacing - 1e-6),
            "columns": ceil(ratio * width / spacing - 1e-6),
        }
    inner = {"window": {**times, **window}, "field_of_view": {**grid, **view}}
    filled = {name: section for name, section in inner.items() if section}
    return {**study, "cutting": {**length, **cutting, **filled}}


def with_pitch(camera: Mapping[str, Any], from_file: bool = True) -> dict[str, Any]:
    """Return a camera's data with the pitch on the scene that follows from its data sheet."""
    detector, magnification = (camera.get(name) for name in ("detector_pitch", "magnification"))
    if detector in (None, "none"):
        return dict(camera)
    if isinstance(magnification, bool) or not isinstance(magnification, int | float):
        raise ValueError("magnification: must be given with detector_pitch")
    if not magnification > 0:
        raise ValueError(f"magnification: {magnification:g}, must be positive")
    try:
        pitch = LENGTH.parse(detector, si=not from_file) / magnification
    except ValueError as error:
        raise ValueError(f"detector_pitch: {error}") from None
    given = LENGTH.parse(camera["pitch"], si=not from_file) if "pitch" in camera else pitch
    if abs(given - pitch) > 1e-6 * pitch:
        raise ValueError(
            f"pitch: {camera['pitch']} contradicts detector_pitch / magnification, "
            f"{LENGTH.text(pitch)}; state only one of them"
        )
    return {**camera, "magnification": float(magnification), "pitch": LENGTH.text(pitch)}
