"""The embedded cutting simulation."""

from typing import TYPE_CHECKING, Any

from chipglow.cutting import library
from chipglow.cutting.checkpoint import Checkpoint
from chipglow.cutting.conditions import (
    CuttingConditions,
    Friction,
    Numerics,
    OutputWindow,
    Surroundings,
    unresolved,
)
from chipglow.cutting.damage import FittedDamage, JohnsonCookDamage
from chipglow.cutting.energy import EnergyHistory
from chipglow.cutting.flow_stress import FLOW_LAWS, FlowStress
from chipglow.cutting.laws import HyperbolicTangent, JohnsonCook, MarusichOrtiz, ZerilliArmstrong
from chipglow.cutting.library import (
    MaterialError,
    MaterialFile,
    is_own_file,
    material_file,
    material_names,
    tool_material,
    workpiece,
)
from chipglow.cutting.material import (
    NonlocalViscosity,
    RateTable,
    TemperatureTable,
    ToolMaterial,
    WorkpieceMaterial,
)
from chipglow.cutting.recording import Preview
from chipglow.cutting.simulation import SOLVER_VERSION, CuttingSimulation, ForceHistory, SolverError
from chipglow.cutting.steady_tool import SteadyTool, ToolBody

if TYPE_CHECKING:
    from chipglow.cutting.library import AISI_1045, CARBIDE

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


def __getattr__(name: str) -> Any:
    """Leave the constants to the library, which reads them when they are first used."""
    if name in ("AISI_1045", "CARBIDE"):
        return getattr(library, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
