"""The embedded cutting simulation."""

from chipglow.cutting.conditions import (
    CutSettings as CutSettings,
    CuttingConditions as CuttingConditions,
    Friction as Friction,
    Numerics as Numerics,
    OutputWindow as OutputWindow,
    Surroundings as Surroundings,
    unresolved as unresolved,
)
from chipglow.cutting.damage import (
    FittedDamage as FittedDamage,
    JohnsonCookDamage as JohnsonCookDamage,
)
from chipglow.cutting.flow_stress import FLOW_LAWS as FLOW_LAWS, FlowStress as FlowStress
from chipglow.cutting.laws import (
    HyperbolicTangent as HyperbolicTangent,
    JohnsonCook as JohnsonCook,
    MarusichOrtiz as MarusichOrtiz,
    ZerilliArmstrong as ZerilliArmstrong,
)
from chipglow.cutting.library import (
    MaterialError as MaterialError,
    MaterialFile as MaterialFile,
    is_own_file as is_own_file,
    material_file as material_file,
    material_names as material_names,
    tool_material as tool_material,
    workpiece as workpiece,
)
from chipglow.cutting.material import (
    NonlocalViscosity as NonlocalViscosity,
    RateTable as RateTable,
    TemperatureTable as TemperatureTable,
    ToolMaterial as ToolMaterial,
    WorkpieceMaterial as WorkpieceMaterial,
)
from chipglow.cutting.recording import (
    Checkpoint as Checkpoint,
    EnergyHistory as EnergyHistory,
    Preview as Preview,
)
from chipglow.cutting.simulation import (
    SOLVER_VERSION as SOLVER_VERSION,
    CuttingSimulation as CuttingSimulation,
    ForceHistory as ForceHistory,
    SolverError as SolverError,
)
from chipglow.cutting.steady_tool import SteadyTool as SteadyTool, ToolBody as ToolBody

AISI_1045: WorkpieceMaterial
CARBIDE: ToolMaterial


def __getattr__(name: str) -> WorkpieceMaterial | ToolMaterial:
    """Read the constants when they are first used: files and units take a third of a second."""
    if name == "AISI_1045":
        return workpiece("aisi-1045")
    if name == "CARBIDE":
        return tool_material("carbide")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
