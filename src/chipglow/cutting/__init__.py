"""The embedded cutting simulation."""

from chipglow.cutting.checkpoint import Checkpoint
from chipglow.cutting.conditions import (
    CuttingConditions,
    Friction,
    Numerics,
    OutputWindow,
    Surroundings,
)
from chipglow.cutting.damage import FittedDamage, JohnsonCookDamage
from chipglow.cutting.energy import EnergyHistory
from chipglow.cutting.flow_stress import FLOW_LAWS, FlowStress
from chipglow.cutting.laws import HyperbolicTangent, JohnsonCook, MarusichOrtiz, ZerilliArmstrong
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
from chipglow.cutting.material import RateTable, TemperatureTable, ToolMaterial, WorkpieceMaterial
from chipglow.cutting.nonlocal_viscosity import NonlocalViscosity
from chipglow.cutting.preview import Preview
from chipglow.cutting.resolution import unresolved
from chipglow.cutting.simulation import SOLVER_VERSION, CuttingSimulation, ForceHistory, SolverError
from chipglow.cutting.steady_tool import SteadyTool, ToolBody

__all__ = [
    "AISI_1045",
    "CARBIDE",
    "FLOW_LAWS",
    "SOLVER_VERSION",
    "Checkpoint",
    "CuttingConditions",
    "CuttingSimulation",
    "EnergyHistory",
    "FittedDamage",
    "FlowStress",
    "ForceHistory",
    "Friction",
    "HyperbolicTangent",
    "JohnsonCook",
    "JohnsonCookDamage",
    "MarusichOrtiz",
    "MaterialError",
    "MaterialFile",
    "NonlocalViscosity",
    "Numerics",
    "OutputWindow",
    "Preview",
    "RateTable",
    "SolverError",
    "SteadyTool",
    "Surroundings",
    "TemperatureTable",
    "ToolBody",
    "ToolMaterial",
    "WorkpieceMaterial",
    "ZerilliArmstrong",
    "is_own_file",
    "material_file",
    "material_names",
    "tool_material",
    "unresolved",
    "workpiece",
]
