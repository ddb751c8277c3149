"""Times on the command line."""

from chipglow.study.units import INSTANT


def parse_instant(option: str, text: str) -> float:
    """Time in s of a text such as ``400 us``, which may be 0.

    Raises
    ------
    ValueError
        If it is none; the message names the option.
    """
    try:
        return INSTANT.parse(text)
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None
