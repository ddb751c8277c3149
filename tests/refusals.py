"""What every reader owes a file that is damaged: one line, without much memory."""

import tracemalloc

import pytest

from chipglow.io.sources import SourceError

PNG = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x10\0\0\0\x10\x08\x02\0\0\0\x90\x91h6" + bytes(200)


def refused_on(raster, most, source, *texts):
    """One line that has the texts, with less than `most` bytes of memory."""
    tracemalloc.start()
    with pytest.raises(SourceError) as caught:
        source.survey()
        list(source.frames(raster))
    _, taken = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert taken < most
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 700
    for text in texts:
        assert text in message
