"""A coarse look at a cut while it is computed, from its start to its end."""

from collections.abc import Callable
from dataclasses import dataclass

from chipglow.scene import Frame, Raster


@dataclass(frozen=True)
class Preview:
    """Who looks at a cut while it is computed, how finely and how often.

    Parameters
    ----------
    raster : Raster
        Samples of the frames that are handed over.
    frames : int
        About how many frames are spread evenly over the cut; the last is at its end.
    on_frame : callable
        Called with every frame, in their order. Nothing of the cut depends on what it does.
    """

    raster: Raster
    frames: int
    on_frame: Callable[[Frame], None]

    def __post_init__(self) -> None:
        if self.frames < 1:
            raise ValueError(f"preview frames: expected 1 or more, got {self.frames!r}")

    def shows(self, number: int, last: int) -> bool:
        """Whether it shows one of the frames from 1 to `last`."""
        return (last - number) % max(last // self.frames, 1) == 0
