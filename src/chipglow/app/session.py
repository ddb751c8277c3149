"""The state of one user, and the threads that compute its pictures.

One thread makes pictures, always of the newest state: states between are never computed, and work
for an older one ends at the next opportunity. Draws have a thread of their own.
"""

import logging
from collections.abc import Callable, Mapping
from threading import Condition, Thread
from typing import Final, Generic, TypeAlias, TypeVar

from chipglow.app.controls import State
from chipglow.app.model import Picture, SceneModel, model_of
from chipglow.app.opening import Opened

PAUSE: Final = 0.15
"""Seconds without a newer state after a quick look before the exact picture is begun."""

_PAINT_TIMEOUT: Final = 0.5
"""Seconds to wait for the page to paint a picture before the next one is sent."""

_UNDO_STEPS: Final = 200

_log = logging.getLogger(__name__)
_Job = TypeVar("_Job")


class SupersededError(Exception):
    """The work is no longer needed."""


class Newest(Generic[_Job]):
    """A thread that does only the newest job; `notify` takes the message of an error."""

    def __init__(self, work: Callable[[_Job], None], notify: Callable[[str, str], None]) -> None:
        self._work, self._notify = work, notify
        self._news = Condition()
        self._job: _Job | None = None
        self._busy = self._ended = self._cancelled = False
        self._thread: Thread | None = None

    def ask(self, job: _Job) -> None:
        """Do this job next; waiting and running ones end."""
        with self._news:
            self._job, self._cancelled = job, False
            if self._thread is None:
                self._thread = Thread(target=self._run, name="chipglow app", daemon=True)
                self._thread.start()
            self._news.notify_all()

    def cancel(self) -> None:
        """End the running job and forget the waiting one."""
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
        """Whether the running job is no longer needed."""
        return self._ended or self._cancelled or self._job is not None

    def check(self) -> None:
        """Raise `SupersededError` if the running job is no longer needed."""
        if self.superseded:
            raise SupersededError

    def pause(self, seconds: float) -> None:
        """Let the running job wait, and end it if it is superseded meanwhile."""
        with self._news:
            self._news.wait_for(lambda: self.superseded, seconds)
        self.check()

    def wait_for(self, condition: Callable[[], bool], seconds: float) -> None:
        """Let the running job wait until `wake` finds a condition true."""
        with self._news:
            self._news.wait_for(lambda: self._ended or condition(), seconds)

    def wake(self) -> None:
        """Let a waiting job test its condition again."""
        with self._news:
            self._news.notify_all()

    def settle(self, seconds: float) -> bool:
        """Wait until no job is left; return whether that happened within the time."""
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
                self._notify("failed", str(error))
            except Exception as error:  # a defect: it must not end the session's thread
                _log.exception("chipglow app")
                self._notify("failed", f"defect: {type(error).__name__}: {error}")


Notify: TypeAlias = Callable[..., None]
"""Takes the kind of a result and the result; called from the threads of a session."""


class Session:
    """The state of one user, by default that of the study."""

    def __init__(self, opened: Opened, notify: Notify) -> None:
        self.model = model_of(opened)
        self.state = self.model.controls.initial
        self._settled = [self.state]
        self._at = 0
        self._notify = notify
        self._sent = self._painted = 0
        self._pictures = Newest(self._picture, notify)
        self._draws: Newest[tuple[State, int, int]] = Newest(self._draw, notify)

    def show(self) -> None:
        """Compute the picture of the state."""
        self._draws.cancel()
        self._pictures.ask(self.state)

    def change(self, texts: Mapping[str, str], final: bool = True) -> None:
        """Set controls; only a final state is one that `step` goes to.

        Raises
        ------
        ValueError
            If that is not possible; the state then stays.
        """
        self.set(self.model.changed(self.state, dict(texts)), final)

    def restore(self, texts: Mapping[str, str]) -> None:
        """Set controls without a picture and without a step to undo, as `change` otherwise."""
        self.state = self.model.changed(self.state, dict(texts))

    def set(self, state: State, final: bool = True) -> None:
        """Go to a state."""
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
        self.set(self._settled[self._at], final=False)

    def draw(self, phases: int, textures: int) -> None:
        """Draw the lines at several phases of the pixels and textures."""
        self._draws.ask((self.state, phases, textures))

    def cancel(self) -> None:
        """End the drawing."""
        self._draws.cancel()

    def painted(self, number: int) -> None:
        """Note that the page shows a picture, so that the next one may follow."""
        self._painted = max(self._painted, number)
        self._pictures.wake()

    def end(self) -> None:
        """End the threads."""
        self._pictures.end()
        self._draws.end()

    def settle(self, seconds: float = 60.0) -> bool:
        """Wait until everything is computed; return whether that happened within the time."""
        return self._pictures.settle(seconds) and self._draws.settle(seconds)

    def _picture(self, state: State) -> None:
        """Always send one picture, so that a moving control is followed; then the exact one."""
        work, model = self._pictures, self.model
        if model.has_quick_look and not model.is_ready(state):
            self._send(model.picture(state, quick=True))
            work.pause(PAUSE)
            picture = model.picture(state, check=work.check)
            self._send(picture)
            work.check()
        else:
            picture = model.picture(state)
            self._send(picture)
            # The numbers of a large scene take longer than its picture: a newer state goes first.
            work.pause(PAUSE if model.has_quick_look else 0.0)
        self._notify("readout", picture, self.model.readout(picture))

    def _send(self, picture: Picture) -> None:
        """Send a picture as soon as the page has painted the one before."""
        last = self._sent
        self._pictures.wait_for(lambda: self._painted >= last, _PAINT_TIMEOUT)
        self._sent += 1
        self._notify("picture", self._sent, picture)

    def _draw(self, job: tuple[State, int, int]) -> None:
        state, phases, textures = job

        def progress(done: float) -> None:
            self._draws.check()
            self._notify("progress", done)

        assert isinstance(self.model, SceneModel)
        self._notify("drawn", self.model.drawn(state, phases, textures, progress))
