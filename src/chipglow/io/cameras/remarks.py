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
