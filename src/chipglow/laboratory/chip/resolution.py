"""What the grid of a cutting simulation does not resolve."""

from math import nan

from chipglow.cutting import unresolved
from chipglow.scene import Scene


def resolution_warnings(scene: Scene, band_width: float = nan) -> tuple[str, ...]:
    """Sentences about lengths of a cut that its grid does not resolve."""
    known = str(scene.data.attrs.get("resolution_warnings", ""))
    cell = float(scene.data.attrs.get("cell", 0.0))
    return (*known.splitlines(), *unresolved({"shear band": band_width}, cell))
