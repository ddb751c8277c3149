"""One user's state: the knobs, what was before them, and the threads that compute what they mean.

A thread makes pictures, always of the newest knobs: what was asked for in between is never
computed, and what is under way for older ones ends at the next opportunity. Long work has a thread
of its own.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from threading import Condition, Thread
from typing import Final, Generic, TypeVar

from chipglow.app.knobs import Knobs
from chipglow.app.model import MeasurementModel, SceneModel, model_of
from chipglow.app.opening import OpenedMeasurement, OpenedScene
from chipglow.app.picture import Drawn, Picture, Readout

PAUSE: Final = 0.15
"""Seconds without a newer state after a quick look, before the exact picture is begun."""

_PATIENCE: Final = 0.5
"""Seconds to wait for the page to have painted a picture before the next one is sent."""

_MOST_STEPS: Final = 200

_log = logging.getLogger(__name__)
_Job = TypeVar("_Job")


class SupersededError(Exception):
    """Work that nobody waits for any more."""


class Newest(Generic[_Job]):
    """A thread that does the newest job alone.

    Parameters
    ----------
    work : callable
        Does a job.
    failed : callable
        Told what went wrong.
    """

    def __init__(self, work: Callable[[_Job], None], failed: Callable[[str], None]) -> None:
        self._work, self._failed = work, failed
        self._news = Condition()
        self._job: _Job | None = None
        self._busy = self._ended = self._cancelled = False
        self._thread: Thread | None = None

    def ask(self, job: _Job) -> None:
        """Do this job next, in the place of any that waits; what is under way ends."""
        with self._news:
            self._job, self._cancelled = job, False
            if self._thread is None:
                self._thread = Thread(target=self._run, name="chipglow app", daemon=True)
                self._thread.start()
            self._news.notify_all()

    def cancel(self) -> None:
        """End what is under way, and forget what waits."""
        with self._news:
            self._job, self._cancelled = None, True
            self._news.notify_all()

    def end(self) -> None:
        """Cancel, and end the thread."""
        with self._news:
            self._ended = True
        self.cancel()

    @property
    def superseded(self) -> bool:
        """Whether nobody waits for what is under way."""
        return self._ended or self._cancelled or self._job is not None

    def check(self) -> None:
        """End the job that calls it if nobody waits for it.

        Raises
        ------
        SupersededError
            If so.
        """
        if self.superseded:
            raise SupersededError

    def pause(self, seconds: float) -> None:
        """Let a job wait, and end it if meanwhile nobody waits for it any more."""
        with self._news:
            self._news.wait_for(lambda: self.superseded, seconds)
        self.check()

    def wait_for(self, condition: Callable[[], bool], seconds: float) -> None:
        """Let a job wait until `wake` finds a condition true, or the time is over."""
        with self._news:
            self._news.wait_for(lambda: self._ended or condition(), seconds)

    def wake(self) -> None:
        """Let a job that waits for a condition look again."""
        with self._news:
            self._news.notify_all()

    def settle(self, seconds: float) -> bool:
        """Wait until there is nothing to do; whether that came within the time."""
        with self._news:
            return self._news.wait_for(lambda: self._job is None and not self._busy, seconds)

    def _run(self) -> None:
        while True:
            with self._news:
                self._busy = False
                self._news.notify_all()
                self._news.wait_for(lambda: self._job is not None or self._ended)
                if self._ended:
                    return
                job, self._job, self._busy, self._cancelled = self._job, None, True, False
            assert job is not None
            try:
                self._work(job)
            except SupersededError:
                continue
            except (ValueError, OSError) as error:
                self._failed(str(error))
            except Exception as error:  # a defect: it must not end the session's thread
                _log.exception("chipglow app")
                self._failed(f"defect: {type(error).__name__}: {error}")


@dataclass(frozen=True)
class Listener:
    """Who is told what the threads of a session find; called from these threads.

    Parameters
    ----------
    picture, readout, drawn : callable
        Take what was found; `readout` the picture besides.
    progress : callable
        Takes the progress of long work, 0 to 1.
    failed : callable
        Takes what went wrong, a sentence.
    """

    picture: Callable[[int, Picture], None]
    readout: Callable[[Picture, Readout], None]
    drawn: Callable[[Drawn], None]
    progress: Callable[[float], None]
    failed: Callable[[str], None]


class Session:
    """One user's state.

    Parameters
    ----------
    opened : OpenedScene or OpenedMeasurement
        What is looked at.
    listener : Listener
        Who is told.
    knobs : Knobs, optional
        The first state; that of the study by default.
    """

    def __init__(
        self,
        opened: OpenedScene | OpenedMeasurement,
        listener: Listener,
        knobs: Knobs | None = None,
    ) -> None:
        self.opened = opened
        self.model: SceneModel | MeasurementModel = model_of(opened)
        self.knobs = knobs or self.model.panel.initial
        self._settled: list[Knobs] = [self.knobs]
        self._listener = listener
        self._number = self._painted = 0
        self._pictures = Newest(self._picture, listener.failed)
        self._draws: Newest[tuple[Knobs, int, int]] = Newest(self._draw, listener.failed)

    def show(self) -> None:
        """Compute what the knobs mean now."""
        self._draws.cancel()
        self._pictures.ask(self.knobs)

    def turn(self, texts: Mapping[str, str], final: bool = True) -> None:
        """Turn knobs.

        Parameters
        ----------
        texts : mapping
            Their new values, by name.
        final : bool
            Whether the hand has let go of the knob: `undo` goes back to such states.

        Raises
        ------
        ValueError
            If that is not possible; the knobs then stay.
        """
        self.set(self.model.turned(self.knobs, texts), final)

    def set(self, knobs: Knobs, final: bool = True) -> None:
        """Go to a state of the knobs."""
        if final and knobs != self._settled[-1]:
            self._settled = [*self._settled[-_MOST_STEPS:], knobs]
        if knobs != self.knobs:
            self.knobs = knobs
            self.show()

    @property
    def can_undo(self) -> bool:
        """Whether there was another state before."""
        return len(self._settled) > 1 or self.knobs != self._settled[-1]

    def undo(self) -> None:
        """Go back to the state before."""
        if self.knobs == self._settled[-1] and len(self._settled) > 1:
            self._settled = self._settled[:-1]
        self.set(self._settled[-1], final=False)

    def draw(self, phases: int, textures: int) -> None:
        """Draw the lines anew over phases of the pixels and textures."""
        self._draws.ask((self.knobs, phases, textures))

    def cancel(self) -> None:
        """End the drawing."""
        self._draws.cancel()

    def painted(self, number: int) -> None:
        """Note that the page shows a picture: the next one may come."""
        self._painted = max(self._painted, number)
        self._pictures.wake()

    def end(self) -> None:
        """End the threads."""
        self._pictures.end()
        self._draws.end()

    def settle(self, seconds: float = 60.0) -> bool:
        """Wait until all is computed; whether that came within the time."""
        return self._pictures.settle(seconds) and self._draws.settle(seconds)

    def _picture(self, knobs: Knobs) -> None:
        """One picture always arrives, so that a knob in motion is followed; then what is exact."""
        work = self._pictures
        if self.model.has_quick_look and not self.model.is_ready(knobs):
            self._tell(self.model.picture(knobs, quick=True))
            work.pause(PAUSE)
            picture = self.model.picture(knobs, check=work.check)
            self._tell(picture)
            work.check()
        else:
            picture = self.model.picture(knobs)
            self._tell(picture)
            # The numbers of a large scene take longer than its picture: they let the next go first.
            work.pause(PAUSE if self.model.has_quick_look else 0.0)
        self._listener.readout(picture, self.model.readout(picture))

    def _tell(self, picture: Picture) -> None:
        """Send a picture as soon as the page has painted the one before."""
        last = self._number
        self._pictures.wait_for(lambda: self._painted >= last, _PATIENCE)
        self._number += 1
        self._listener.picture(self._number, picture)

    def _draw(self, job: tuple[Knobs, int, int]) -> None:
        knobs, phases, textures = job

        def progress(done: float) -> None:
            self._draws.check()
            self._listener.progress(done)

        assert isinstance(self.model, SceneModel)
        self._listener.drawn(self.model.drawn(knobs, phases, textures, progress))
