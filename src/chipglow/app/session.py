"""The state of one user, and the threads that compute pictures, always of the newest state."""

import logging
from collections.abc import Callable
from dataclasses import replace
from threading import Event, Lock, Thread
from typing import Final, Generic, TypeAlias, TypeVar

from chipglow.app.controls import CORRECTION, State, Texts
from chipglow.app.frames_model import CorrectionModel, KnownRegions, MeasurementModel
from chipglow.app.models import Model
from chipglow.app.pictures import Picture
from chipglow.app.scene_model import SceneModel

PAUSE: Final = 0.15
"""Seconds without a newer state after a quick look before the exact picture is begun."""

PHASES: Final = 3
"""Pixel phases along each axis of the app's draws."""

TEXTURES: Final = 5
"""Textures of the app's draws."""

_PAINT_TIMEOUT: Final = 0.5
"""Seconds to wait for the page to paint a picture before the next one is sent."""

_UNDO_STEPS: Final = 200
"""Settings that can be undone."""

_log = logging.getLogger(__name__)
_Job = TypeVar("_Job")


class SupersededError(Exception):
    """The work is no longer needed."""


class Newest(Generic[_Job]):
    """Does only the newest job, in a thread; `notify` takes the message of an error."""

    def __init__(self, work: Callable[[_Job], None], notify: Callable[[str, str], None]) -> None:
        self._work, self._notify = work, notify
        self._turn = Lock()
        self._superseded = Event()
        self._running = Event()

    def ask(self, job: _Job) -> None:
        """Do this job next; waiting and running ones end."""
        self.cancel()
        self._superseded = Event()
        Thread(target=self._run, args=(job, self._superseded), daemon=True).start()

    def cancel(self) -> None:
        """End the running job and forget the waiting ones."""
        self._superseded.set()

    def check(self) -> None:
        """Raise `SupersededError` if the running job is no longer needed."""
        self.pause(0.0)

    def pause(self, seconds: float) -> None:
        """Let the running job wait, and stop it if it is superseded."""
        if self._running.wait(seconds):
            raise SupersededError

    def _run(self, job: _Job, superseded: Event) -> None:
        with self._turn:
            if superseded.is_set():
                return
            self._running = superseded
            try:
                self._work(job)
            except SupersededError:
                pass
            except (ValueError, OSError) as error:
                self._notify("failed", str(error))
            except Exception as error:  # a defect: it must not leave the page waiting
                if superseded.is_set():
                    return  # such as an error of a pool, which ends with the interpreter
                _log.exception("chipglow app")
                self._notify("failed", f"defect: {type(error).__name__}: {error}")


Notify: TypeAlias = Callable[..., None]
"""Takes the kind of a result and the result; called from the threads of a session."""


class Session:
    """The state of one user, by default the study's."""

    def __init__(self, opened: Model, notify: Notify) -> None:
        self.model = replace(opened)
        self.state = opened.controls.initial
        self._settled, self._at = [self.state], 0
        self._notify = notify
        self._sent, self._painted = 0, Event()
        self._painted.set()
        self._pictures = Newest(self._picture, notify)
        self._draws = Newest(self._draw, notify)

    def know(self, regions: KnownRegions) -> None:
        """Set the regions of the page; a correction distinguishes those with an emissivity."""
        model = self.model
        if not isinstance(model, MeasurementModel):
            return
        before, model.regions = model.zones(self.state.study), regions
        if model.zones(self.state.study) != before:
            self.show()

    def show(self) -> None:
        self._draws.cancel()
        self._pictures.ask(self.state)

    def change(self, texts: Texts, final: bool = True) -> None:
        """Set controls; only a final state is one that `step` goes to."""
        self._set(self.model.controls.state_with(self.state, texts), final)

    def restore(self, texts: Texts) -> None:
        """Set controls without a picture and without a step to undo, as `change` otherwise."""
        self.state = self.model.controls.state_with(self.state, texts)

    def _set(self, state: State, final: bool) -> None:
        if final and state != self._settled[self._at]:
            self._settled = [*self._settled[: self._at + 1][-_UNDO_STEPS:], state]
            self._at = len(self._settled) - 1
        if state != self.state:
            self.state = state
            self.show()

    @property
    def can_undo(self) -> bool:
        """Whether there is a state before."""
        return self._at > 0 or self.state != self._settled[self._at]

    @property
    def can_redo(self) -> bool:
        """Whether there is a state that was undone."""
        return self._at + 1 < len(self._settled)

    def step(self, forward: bool) -> None:
        """Go back to the state before, or forward to the one that was undone last."""
        if forward:
            self._at = min(self._at + 1, len(self._settled) - 1)
        elif self.state == self._settled[self._at]:
            self._at = max(self._at - 1, 0)
        self._set(self._settled[self._at], final=False)

    def draw(self) -> None:
        """Draw the lines at several phases of the pixels and textures."""
        self._draws.ask(self.state)

    def cancel(self) -> None:
        """End draws and a correction."""
        self._draws.cancel()
        self._pictures.cancel()

    def painted(self, number: int) -> None:
        """Note that the page shows a picture, so that the next one may follow."""
        if number >= self._sent:
            self._painted.set()

    def end(self) -> None:
        self._pictures.cancel()
        self._draws.cancel()

    def _picture(self, state: State) -> None:
        """Send a picture at once, so that it follows a moving control, then the exact one."""
        work, model = self._pictures, self.model
        if isinstance(model, SceneModel) and not model.is_ready(state):
            self._send(model.picture(state, quick=True))
            work.pause(PAUSE)
            picture = model.picture(state, check=work.check)
            self._send(picture)
            work.check()
        elif isinstance(model, SceneModel):
            picture = model.picture(state)
            self._send(picture)
            # The numbers of a large scene take longer than its picture: a newer state goes first.
            work.pause(PAUSE if model.coarse else 0.0)
        else:  # frames of a file: the page draws picture and numbers once
            picture = model.picture(state)
            numbers = model.numbers(picture)
            self._send(picture, numbers)
        if isinstance(model, SceneModel):
            numbers = model.numbers(picture)
            self._notify("numbers", picture, numbers, {})
        if state.study.images == CORRECTION:
            self._correct(picture, numbers)
        elif state.second is not None:
            return
        elif contributions := model.contributions(picture, work.check):
            self._notify("numbers", picture, numbers, contributions)

    def _correct(self, picture: Picture, numbers: dict[str, float]) -> None:
        """Send the picture again with the corrected image, unless it has it already."""
        model = self.model
        if picture.corrected is not None or isinstance(model, CorrectionModel):
            return
        if needs := model.needs(picture.state):
            self._notify("needs", needs)
            return
        self._notify("correcting", 0.0)

        def check(done: float) -> None:
            self._pictures.check()
            self._notify("correcting", done)

        corrected = model.corrected(picture, check)
        self._send(corrected)
        self._notify("numbers", corrected, numbers, {})

    def _send(self, picture: Picture, *numbers: dict[str, float]) -> None:
        """Send a picture, with its numbers if known, when the page has painted the one before."""
        self._painted.wait(_PAINT_TIMEOUT)
        self._painted.clear()
        self._sent += 1
        self._notify("picture", self._sent, picture, *numbers)

    def _draw(self, state: State) -> None:
        def progress(done: float) -> None:
            self._draws.check()
            self._notify("progress", done)

        assert isinstance(self.model, SceneModel)
        self._notify("drawn", self.model.drawn(state, PHASES, TEXTURES, progress))
