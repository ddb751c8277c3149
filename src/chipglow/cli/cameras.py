"""The command ``chipglow cameras``."""

from typing import TYPE_CHECKING, Annotated, Any, Final

from chipglow.cli import options as opt
from chipglow.cli.screen import current

if TYPE_CHECKING:
    from collections.abc import Mapping

_NOT_STATED: Final = "not stated"


def cameras(
    name: Annotated[str | None, opt.argument("NAME", "Camera to show with its source.")] = None,
) -> None:
    """List the cameras that a study knows by name, or show one with the source of its numbers."""
    import pandas as pd

    from chipglow.study.camera_section import CAMERAS

    screen = current()
    if name is None:
        rows = [{"name": one, **_summary(preset)} for one, preset in CAMERAS.items()]
        screen.table("cameras", pd.DataFrame(rows), unbroken=("name",))
        return
    if name not in CAMERAS:
        raise ValueError(f"{name}: unknown camera, expected one of {', '.join(CAMERAS)}")
    preset = CAMERAS[name]
    screen.facts("camera", _summary(preset).items())
    screen.heading()
    screen.say(f"Source: {preset['source']}.")
    screen.say(
        f"In a study: camera: {{preset: {name}, magnification: 2.5}}, or instead of the "
        "magnification the distance of the pixels on the scene: pitch: 6 um. Values that are not "
        "stated must be given."
    )


def _summary(preset: "Mapping[str, Any]") -> dict[str, str]:
    """Return what is stated of a camera, as text."""
    rate = str(preset.get("frame_rate", _NOT_STATED))
    windows = [f"{size}: {fastest}" for size, fastest in preset.get("windows", {}).items()]
    terms = preset.get("detector", {}).get("terms", [])
    of_terms = (one["netd"] for one in terms if one["kind"] == "netd")
    return {
        "pixels": " x ".join(map(str, preset.get("array", []))) or _NOT_STATED,
        "pitch": str(preset.get("detector_pitch", _NOT_STATED)),
        "band": str(preset.get("band", _NOT_STATED)),
        "frame rate": "; ".join([rate, *windows]),
        "NETD": str(preset.get("netd", next(of_terms, _NOT_STATED))),
    }
