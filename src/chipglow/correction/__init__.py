"""The true temperature of every pixel from measured frames, with its uncertainty."""

from chipglow.correction.correct import correct as correct
from chipglow.correction.correction import (
    UNDETERMINED as UNDETERMINED,
    Correction as Correction,
    CorrectionFlag as CorrectionFlag,
    joined as joined,
)
from chipglow.correction.file import (
    read_correction as read_correction,
    write_correction as write_correction,
)
from chipglow.correction.known import KnownPart as KnownPart, known_parts as known_parts
from chipglow.correction.known_object import (
    correct_known as correct_known,
    correct_mapped as correct_mapped,
)
from chipglow.correction.places import place_frame as place_frame, places_of as places_of
from chipglow.correction.scene_object import (
    observed_scene as observed_scene,
    scene_truth as scene_truth,
    surroundings_of as surroundings_of,
)
from chipglow.correction.zones import (
    Motion as Motion,
    ObservedObject as ObservedObject,
    SampledObject as SampledObject,
    ShapedObject as ShapedObject,
    Zone as Zone,
)
