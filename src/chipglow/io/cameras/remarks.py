"""What there is to say of a camera's file, collected while it is read."""

from dataclasses import dataclass, field, replace

from chipglow.camera import Recording
from chipglow.text.remarks import Remarks


@dataclass(frozen=True)
class FileRemarks(Remarks):
    """Sentences of a camera's file, of which assumptions and warnings are kept apart.

    Parameters
    ----------
    notes : list of str
        What else the file says.
    """

    notes: list[str] = field(default_factory=list)

    def kept_with(self, recording: Recording) -> Recording:
        """The recording with all that was said of its file."""
        return replace(
            recording,
            notes=tuple(self.notes),
            assumptions=tuple(self.assumptions),
            warnings=tuple(self.warnings),
        )

    def say_cut(self, said: int, whole: int) -> None:
        """Warn if a file, which should have so many frames, has fewer whole ones."""
        if whole < said:
            self.warnings.append(
                f"the file is cut short: of its {said} frames the first {whole} are whole, the "
                "others are left out."
            )

    def say_cut_behind(self, whole: int, left: int) -> None:
        """Warn that a file, which does not say its number of frames, ends with bytes of one."""
        self.warnings.append(
            f"the file is cut short: its first {whole} frames are whole, the {left} bytes behind "
            "them are no whole frame and are left out."
        )
