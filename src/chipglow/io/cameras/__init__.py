"""Readers of real cameras' files, and a writer of one."""

from chipglow.io.cameras.formats import CAMERA_FORMATS, CameraFormat
from chipglow.io.cameras.hcc import write_hcc
from chipglow.io.cameras.recordings import read_recording

__all__ = [
    "CAMERA_FORMATS",
    "CameraFormat",
    "read_recording",
    "write_hcc",
]
