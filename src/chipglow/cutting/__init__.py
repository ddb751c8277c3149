"""The embedded cutting simulation."""

from chipglow.cutting.checkpoint import Checkpoint
from chipglow.cutting.conditions import CuttingConditions, Friction, Numerics, OutputWindow
from chipglow.cutting.energy import EnergyHistory
from chipglow.cutting.library import (
    AISI_1045,
    CARBIDE,
    MaterialError,
    MaterialFile,
    is_own_file,
    material_file,
    material_names,
    tool_material,
    workpiece,
)
from chipglow.cutting.material import (
    DamageSoftening,
    JohnsonCook,
    TemperatureTable,
    ToolMaterial,
    WorkpieceMaterial,
)
from chipglow.cutting.simulation import (
    SOLVER_VERSION,
    CuttingSimulation,
    ForceHistory,
    SolverError,
)

__all__ = [
    "AISI_1045",
    "CARBIDE",
    "SOLVER_VERSION",
    "Checkpoint",
    "CuttingConditions",
    "CuttingSimulation",
    "DamageSoftening",
    "EnergyHistory",
    "ForceHistory",
    "Friction",
    "JohnsonCook",
    "MaterialError",
    "MaterialFile",
    "Numerics",
    "OutputWindow",
    "SolverError",
    "TemperatureTable",
    "ToolMaterial",
    "WorkpieceMaterial",
    "is_own_file",
    "material_file",
    "material_names",
    "tool_material",
    "workpiece",
]
