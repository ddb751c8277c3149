"""The open file of a page: its frames, and the images that the figures show."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from chipglow.app.pictures import Corrected, Panel, Picture
from chipglow.camera import Measurement
from chipglow.laboratory.emissivity import StoredEmissivities
from chipglow.quantities import ZERO_CELSIUS, Array, Brief
from chipglow.scene import Raster
from chipglow.text import Notes


class Frames(Protocol):
    """Frames of radiance temperature, each read or computed when it is asked for."""

    @property
    def times(self) -> Array:
        """Start of each frame in s."""
        ...

    @property
    def raster(self) -> Raster:
        """Grid of the pixels."""
        ...

    def kelvins(self, index: int) -> Array:
        """Return the radiance temperature of a frame in K, shape (y, x); NaN out of range."""
        ...


@dataclass(frozen=True, eq=False, repr=False)
class ShownImage(Brief):
    """An image as a figure shows it.

    Temperatures and differences of temperatures are in K, others in `unit`; NaN where undefined.
    """

    title: str
    values: Array
    raster: Raster
    unit: str
    is_temperature: bool
    """Whether the values are temperatures, which pages show in °C, and no differences of them."""

    @classmethod
    def of(cls, panel: Panel) -> "ShownImage":
        """Return the image of a panel, whose temperatures are in °C."""
        if panel.unit != "°C":
            return cls(panel.name, panel.values, panel.raster, panel.unit, False)
        return cls(panel.name, panel.values + ZERO_CELSIUS, panel.raster, "K", True)


@dataclass(eq=False)
class Opened:
    """The open file of one page; `frames`, `frame` and `images` change with the shown picture.

    The keys of `figures`, Bokeh's figures with axes in µm, are the names of the images: ``scene``,
    ``measured``, ``corrected``, ``half_width``, ``true`` and ``error``, where available.
    """

    name: str
    source: str
    """The file as a session names it."""
    notes: Notes
    figures: Mapping[str, Any]
    frames: Frames
    """Of a scene those of the camera with its present settings."""
    frame: int = field(init=False, default=0)
    """Index of the frame that is shown."""
    images: Mapping[str, ShownImage] = field(init=False, default_factory=dict)
    measured: Measurement | None = field(init=False, default=None)
    """The frame that is shown, with its band and flags; None of a correction."""
    corrected: Corrected | None = field(init=False, default=None)
    """The frame's correction, if it is shown."""
    surroundings: tuple[float, float] | None = field(init=False, default=None)
    """Temperature of the reflected surroundings and its standard uncertainty in K, if stated."""
    emissivities: StoredEmissivities | None = field(init=False, default=None)
    """Emissivities of a file that the page names."""
    correction: Mapping[str, Any] = field(init=False, default_factory=dict)
    """Settings of the page for a correction, as in a file of places."""
    _shown: Any = field(init=False, default=None, repr=False)
    _panels: Mapping[str, Panel] = field(init=False, default_factory=dict, repr=False)
    """Kept, so that no other arrays have their places in memory."""
    _listeners: list[Callable[[], None]] = field(init=False, default_factory=list, repr=False)

    def watch(self, listener: Callable[[], None]) -> None:
        """Call a function after each change of the page, in the thread of the page."""
        self._listeners.append(listener)

    def show(
        self,
        picture: Picture,
        frames: Frames,
        frame: int,
        measured: Measurement | None,
        emissivities: StoredEmissivities | None,
    ) -> None:
        """Take the images of an exact picture, all frames, and what is known of its frame."""
        study = picture.state.study
        reflected = study.camera.reflected
        surroundings = None if reflected is None else (reflected, study.reflected_uncertainty)
        images = {name: id(one.values) for name, one in picture.panels.items()}
        shown = frame, surroundings, emissivities, images
        if shown == self._shown:  # the cursor moved
            return
        self._shown, self._panels = shown, picture.panels
        self.images = {name: ShownImage.of(panel) for name, panel in picture.panels.items()}
        self.frames, self.frame = frames, frame
        self.measured, self.corrected = measured, picture.corrected
        self.surroundings, self.emissivities = surroundings, emissivities
        for listener in self._listeners:
            listener()
