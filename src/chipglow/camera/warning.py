"""What is possible, and probably not meant."""


class ChipglowWarning(UserWarning):
    """A setting that is possible, and probably not meant, such as °C where K are due."""
