"""Infrared images on visible ones: which point is where, and when."""

from chipglow.laboratory.registration.dots import DotFit, Dots, find_dots, fit_dots
from chipglow.laboratory.registration.file import load_registration, write_registration
from chipglow.laboratory.registration.input_files import read_pictures, read_points
from chipglow.laboratory.registration.mutual_information import ImageFit, fit_images
from chipglow.laboratory.registration.registration import PointFit, Registration, fit_points
from chipglow.laboratory.registration.time_alignment import (
    RecordingAlignment,
    TimeAlignment,
    align_recordings,
    align_times,
    infrared_radiance,
    simultaneous_frames,
)

__all__ = [
    "DotFit",
    "Dots",
    "ImageFit",
    "PointFit",
    "RecordingAlignment",
    "Registration",
    "TimeAlignment",
    "align_recordings",
    "align_times",
    "find_dots",
    "fit_dots",
    "fit_images",
    "fit_points",
    "infrared_radiance",
    "load_registration",
    "read_pictures",
    "read_points",
    "simultaneous_frames",
    "write_registration",
]
