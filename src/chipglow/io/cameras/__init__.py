"""Readers of real cameras' files, and a writer of one."""

from chipglow.io.cameras.formats import CameraFormat, camera_formats, read_recording
from chipglow.io.cameras.hcc import write_hcc

__all__ = ["CameraFormat", "camera_formats", "read_recording", "write_hcc"]
