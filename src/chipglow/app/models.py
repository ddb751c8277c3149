"""The subject of a page: a scene, a measurement or a correction."""

from typing import TypeAlias

from chipglow.app.frames_model import CorrectionModel, MeasurementModel
from chipglow.app.scene_model import SceneModel

Model: TypeAlias = SceneModel | MeasurementModel | CorrectionModel
