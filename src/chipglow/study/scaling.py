"""Defaults that follow what a study says: view, window and cutting length, as the feed asks."""

from collections.abc import Mapping
from math import ceil
from typing import Any, Final

from chipglow.quantities.units import CUT_LENGTH, LENGTH, POSITION, SPEED, TIME, Quantity

_PAPERS: Final = {"feed": 0.3e-3, "speed": 250 / 60, "pitch": 6e-6, "integration_time": 10e-6}
_START, _END, _LENGTH = 1.579e-3, 1.958e-3, 2.6e-3
_LEFT, _TOP, _WIDTH, _HEIGHT = -620e-6, 460e-6, 660e-6, 540e-6
_INTERVAL, _BAND = 0.2e-6, 10e-6
_ACROSS: Final = 9
"""Samples along a pixel, as in the paper."""

_EXPOSURES: Final = 3.0
"""A window that is made longer holds so many exposures."""

_SUB_FRAMES: Final = 10
"""Frames that an exposure has at least."""


def scaled(study: Mapping[str, Any], from_file: bool = True) -> dict[str, Any]:
    """A study's data with the defaults that follow from its feed, speed and camera.

    Lengths of the cut, the window and the view go with the feed, the time between frames with the
    time in which the chip moves as far; samples are a ninth of a pixel, and an exposure fits into
    what is kept. What the study says itself stays.
    """
    cutting, camera = (_section(study, name) for name in ("cutting", "camera"))
    if camera is not None:
        try:
            camera = with_pitch(camera, from_file)
        except ValueError:  # said by the section itself, with its name
            return dict(study)
    if cutting is None or camera is None or study.get("scene", "none") not in ("none", None):
        return dict(study)
    feed, speed, pitch, exposure = (
        _value(section, name, quantity, from_file)
        for section, name, quantity in (
            (cutting, "feed", CUT_LENGTH),
            (cutting, "speed", SPEED),
            (camera, "pitch", LENGTH),
            (camera, "integration_time", TIME),
        )
    )
    if None in (feed, speed, pitch, exposure):
        return dict(study)
    assert feed and speed and pitch and exposure
    window, view = _section(cutting, "window"), _section(cutting, "field_of_view")
    if window is None or view is None:
        return dict(study)
    ratio, slower = feed / _PAPERS["feed"], _PAPERS["speed"] / speed
    derived: dict[str, Any] = {"window": {}, "field_of_view": {}}
    start = _value(window, "start", CUT_LENGTH, from_file) or ratio * _START
    travel = max(ratio * (_END - _START), _EXPOSURES * exposure * speed)
    if ratio != 1.0 or exposure * speed > _END - _START:
        end = _value(window, "end", CUT_LENGTH, from_file) or start + travel
        derived["window"] |= {"start": CUT_LENGTH.text(start), "end": CUT_LENGTH.text(end)}
        derived["cutting_length"] = CUT_LENGTH.text(max(ratio * _LENGTH, 1.05 * end))
    if ratio != 1.0 or slower != 1.0:
        interval = min(ratio * slower * _INTERVAL, exposure / _SUB_FRAMES)
        derived["window"]["interval"] = TIME.text(interval)
    if exposure > _BAND:
        derived["window"]["band_duration"] = TIME.text(exposure)
    if ratio != 1.0:
        spacing = _value(view, "spacing", LENGTH, from_file) or pitch / _ACROSS
        derived["field_of_view"] = {
            "left": POSITION.text(ratio * _LEFT),
            "top": POSITION.text(ratio * _TOP),
            "spacing": LENGTH.text(spacing),
            "rows": ceil(ratio * _HEIGHT / spacing - 1e-6),
            "columns": ceil(ratio * _WIDTH / spacing - 1e-6),
        }
    inner = {"window": window, "field_of_view": view}
    joined = {name: {**derived[name], **given} for name, given in inner.items()}
    outer = {name: value for name, value in derived.items() if name not in inner}
    filled = {name: section for name, section in joined.items() if section}
    return {**study, "cutting": {**outer, **cutting, **filled}}


def with_pitch(camera: Mapping[str, Any], from_file: bool = True) -> dict[str, Any]:
    """A camera's data with the pitch on the scene that its data sheet makes."""
    detector, magnification = (camera.get(name) for name in ("detector_pitch", "magnification"))
    if detector in (None, "none"):
        return dict(camera)
    if isinstance(magnification, bool) or not isinstance(magnification, int | float):
        raise ValueError("magnification: is missing, expected it with detector_pitch")
    if not magnification > 0:
        raise ValueError(f"magnification: {magnification:g}, expected over 0")
    pitch = LENGTH.parse(detector, si=not from_file) / magnification
    given = _value(camera, "pitch", LENGTH, from_file) if "pitch" in camera else pitch
    if given is None or abs(given - pitch) > 1e-6 * pitch:
        raise ValueError(
            f"pitch: {camera['pitch']} beside a detector_pitch that makes {LENGTH.text(pitch)}, "
            "expected one of them"
        )
    return {**camera, "magnification": float(magnification), "pitch": LENGTH.text(pitch)}


def _section(data: Mapping[str, Any], name: str) -> Mapping[str, Any] | None:
    """A section, empty if it is not there; None for what is no section, which is said later."""
    section = data.get(name)
    if section is None:
        return {}
    return section if isinstance(section, Mapping) else None


def _value(
    section: Mapping[str, Any], name: str, quantity: Quantity, from_file: bool
) -> float | None:
    """What a section says in SI, or the paper's; None for what is no quantity, said later."""
    if name not in section:
        return _PAPERS.get(name)
    try:
        return quantity.parse(section[name], si=not from_file)
    except ValueError:
        return None
