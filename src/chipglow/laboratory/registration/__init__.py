"""Infrared images on visible ones: which point is where, and when."""

from chipglow.laboratory.registration.dots import (
    DotFit as DotFit,
    Dots as Dots,
    find_dots as find_dots,
    fit_dots as fit_dots,
)
from chipglow.laboratory.registration.files import (
    load_registration as load_registration,
    read_pictures as read_pictures,
    read_points as read_points,
    write_registration as write_registration,
)
from chipglow.laboratory.registration.registration import (
    PointFit as PointFit,
    Registration as Registration,
    fit_points as fit_points,
)
from chipglow.laboratory.registration.time_alignment import (
    RecordingAlignment as RecordingAlignment,
    TimeAlignment as TimeAlignment,
    align_recordings as align_recordings,
    align_times as align_times,
    infrared_radiance as infrared_radiance,
    simultaneous_frames as simultaneous_frames,
)
