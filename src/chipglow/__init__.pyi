from . import (
    analysis as analysis,
    app as app,
    camera as camera,
    chip as chip,
    correction as correction,
    cutting as cutting,
    io as io,
    laboratory as laboratory,
    quantities as quantities,
    radiometry as radiometry,
    report as report,
    scene as scene,
    study as study,
    surface as surface,
    uncertainty as uncertainty,
)
from .analysis import (
    Analysis as Analysis,
    Plan as Plan,
    RatioPair as RatioPair,
    analyse as analyse,
    attribute as attribute,
    error_images as error_images,
    error_parts as error_parts,
    ratio_errors as ratio_errors,
)
from .app import explore as explore
from .camera import (
    AnnularAperturePSF as AnnularAperturePSF,
    BlurredPSF as BlurredPSF,
    Camera as Camera,
    Chain as Chain,
    Detector as Detector,
    Effect as Effect,
    EnergyResponse as EnergyResponse,
    Exposure as Exposure,
    GaussianPSF as GaussianPSF,
    Jitter as Jitter,
    MeasuredPSF as MeasuredPSF,
    Measurement as Measurement,
    PhotonResponse as PhotonResponse,
    PupilPSF as PupilPSF,
    ReadNoise as ReadNoise,
    ShotNoise as ShotNoise,
    Veil as Veil,
)
from .correction import Correction as Correction, Zone as Zone, correct as correct
from .cutting import (
    AISI_1045 as AISI_1045,
    CuttingConditions as CuttingConditions,
    CuttingSimulation as CuttingSimulation,
    FlowStress as FlowStress,
)
from .io import (
    example_scene as example_scene,
    import_scene as import_scene,
    load_import as load_import,
    open_scene as open_scene,
    read_measurement as read_measurement,
    read_scene as read_scene,
    write_measurement as write_measurement,
    write_scene as write_scene,
)
from .io.cameras import read_recording as read_recording
from .laboratory.chip import (
    band_profile as band_profile,
    find_tool as find_tool,
    rake_grid as rake_grid,
)
from .laboratory.comparison import compare as compare
from .laboratory.emissivity import (
    Heating as Heating,
    determine_emissivity as determine_emissivity,
    load_regions as load_regions,
    read_emissivity_map as read_emissivity_map,
    true_temperature as true_temperature,
)
from .laboratory.psf import (
    edge_image as edge_image,
    knife_edge as knife_edge,
    write_psf as write_psf,
)
from .laboratory.recordings import load_measurement as load_measurement
from .laboratory.registration import (
    align_times as align_times,
    fit_dots as fit_dots,
    fit_points as fit_points,
    load_registration as load_registration,
    simultaneous_frames as simultaneous_frames,
)
from .radiometry import Band as Band, RatioThermometer as RatioThermometer
from .report import write_report as write_report
from .scene import (
    Raster as Raster,
    Scene as Scene,
    ToolGeometry as ToolGeometry,
    areas as areas,
    scenes as scenes,
)
from .study import (
    Study as Study,
    band_reading as band_reading,
    cut as cut,
    design as design,
    load_study as load_study,
    run as run,
    study_budget as study_budget,
    sweep as sweep,
    wavelengths as wavelengths,
)
from .surface import (
    CHIP_1 as CHIP_1,
    CHIP_2 as CHIP_2,
    Emissivity as Emissivity,
    FeatureSurface as FeatureSurface,
    MapSurface as MapSurface,
    UniformSurface as UniformSurface,
)
from .uncertainty import Estimate as Estimate

__version__: str
