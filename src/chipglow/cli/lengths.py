"""Lengths on the command line."""

from chipglow.study.units import LENGTH


def parse_length(option: str, text: str) -> float:
    """Length in m of a text such as ``18 um``, over 0.

    Raises
    ------
    ValueError
        If it is none; the message names the option.
    """
    try:
        return LENGTH.parse(text)
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None
