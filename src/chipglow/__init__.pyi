from . import camera as camera
from . import cutting as cutting
from . import errors as errors
from . import io as io
from . import laboratory as laboratory
from . import radiometry as radiometry
from . import report as report
from . import scene as scene
from . import study as study
from . import surface as surface
from . import uncertainty as uncertainty
from .camera import (
    AnnularAperturePSF as AnnularAperturePSF,
)
from .camera import (
    Camera as Camera,
)
from .camera import (
    ChipglowWarning as ChipglowWarning,
)
from .camera import (
    Detector as Detector,
)
from .camera import (
    GaussianPSF as GaussianPSF,
)
from .camera import (
    MeasuredPSF as MeasuredPSF,
)
from .camera import (
    Measurement as Measurement,
)
from .cutting import (
    AISI_1045 as AISI_1045,
)
from .cutting import (
    CuttingSimulation as CuttingSimulation,
)
from .cutting import (
    FlowStress as FlowStress,
)
from .cutting import (
    flow_stress_law as flow_stress_law,
)
from .errors import (
    Plan as Plan,
)
from .errors import (
    StudyResult as StudyResult,
)
from .errors import (
    analyse as analyse,
)
from .errors import (
    error_images as error_images,
)
from .io import (
    import_scene as import_scene,
)
from .io import (
    load_import as load_import,
)
from .io import (
    open_scene as open_scene,
)
from .io import (
    read_measurement as read_measurement,
)
from .io import (
    read_scene as read_scene,
)
from .io import (
    write_measurement as write_measurement,
)
from .io import (
    write_scene as write_scene,
)
from .io.cameras import (
    read_recording as read_recording,
)
from .io.cameras import (
    write_hcc as write_hcc,
)
from .laboratory.chip import (
    band_profile as band_profile,
)
from .laboratory.chip import (
    find_tool as find_tool,
)
from .laboratory.chip import (
    rake_grid as rake_grid,
)
from .laboratory.comparison import (
    compare as compare,
)
from .laboratory.emissivity import (
    Heating as Heating,
)
from .laboratory.emissivity import (
    determine_emissivity as determine_emissivity,
)
from .laboratory.emissivity import (
    load_regions as load_regions,
)
from .laboratory.emissivity import (
    read_emissivity_map as read_emissivity_map,
)
from .laboratory.emissivity import (
    true_temperature as true_temperature,
)
from .laboratory.measurement import (
    load_measurement as load_measurement,
)
from .laboratory.psf import (
    edge_image as edge_image,
)
from .laboratory.psf import (
    knife_edge as knife_edge,
)
from .laboratory.psf import (
    write_psf as write_psf,
)
from .laboratory.registration import (
    align_times as align_times,
)
from .laboratory.registration import (
    fit_dots as fit_dots,
)
from .laboratory.registration import (
    fit_images as fit_images,
)
from .laboratory.registration import (
    fit_points as fit_points,
)
from .laboratory.registration import (
    load_registration as load_registration,
)
from .laboratory.registration import (
    simultaneous_frames as simultaneous_frames,
)
from .radiometry import (
    Band as Band,
)
from .report import (
    write_report as write_report,
)
from .scene import (
    Raster as Raster,
)
from .scene import (
    Scene as Scene,
)
from .scene import (
    ToolGeometry as ToolGeometry,
)
from .scene import (
    areas as areas,
)
from .study import (
    Study as Study,
)
from .study import (
    cut as cut,
)
from .study import (
    load_study as load_study,
)
from .study import (
    run as run,
)
from .surface import (
    CHIP_1 as CHIP_1,
)
from .surface import (
    CHIP_2 as CHIP_2,
)
from .surface import (
    Emissivity as Emissivity,
)
from .surface import (
    FeatureSurface as FeatureSurface,
)
from .surface import (
    MapSurface as MapSurface,
)
from .surface import (
    UniformSurface as UniformSurface,
)
from .uncertainty import (
    Estimate as Estimate,
)

__version__: str
