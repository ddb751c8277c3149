"""Assumptions and warnings, collected on the way to a result."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Remarks:
    """Sentences, each without a word such as "Warning" before it.

    Parameters
    ----------
    assumptions : list of str
        What had to be assumed.
    warnings : list of str
        Why the result may not be relied on.
    """

    assumptions: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
