"""What a study says: its sections and fields, the paper's study as defaults, what they mean."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Final, Literal, Self

from pydantic import (
    Field,
    Strict,
    ValidationInfo,
    field_validator,
    model_validator,
)

from chipglow.camera import (
    AnnularAperturePSF,
    Camera,
    GaussianPSF,
    MeasuredPSF,
    PointSpreadFunction,
)
from chipglow.cutting import (
    CuttingConditions,
    CuttingSimulation,
    Friction,
    Numerics,
    OutputWindow,
    Surroundings,
    is_own_file,
    material_names,
    tool_material,
    workpiece,
)
from chipglow.errors import LinePlace, Place, Plan, PointPlace, RegionPlace, ScenePlan
from chipglow.io import ToolSection
from chipglow.io.column_file import read_response
from chipglow.laboratory.emissivity import read_emissivity_map
from chipglow.laboratory.emissivity.regions import RegionSection
from chipglow.quantities.section import (
    OR_NONE,
    FileBeside,
    Part,
    Section,
    beside_the_study,
    described,
)
from chipglow.quantities.units import (
    CutLength,
    Frequency,
    HeatTransfer,
    Length,
    Position,
    Speed,
    Temperature,
    Time,
    Wavelength,
    WavelengthRange,
)
from chipglow.radiometry import Band
from chipglow.scene import Raster
from chipglow.study.scaling import scaled, with_pitch
from chipglow.surface import (
    CHIP_1,
    CHIP_2,
    Emissivity,
    FeatureSurface,
    Surface,
    TemperatureSurface,
    UniformSurface,
)

CHIPS: Final[Mapping[str, FeatureSurface]] = {"chip-1": CHIP_1, "chip-2": CHIP_2}
"""Chips of the paper's Table 1 by the names of a study."""


class FrictionSection(Part):
    """Friction between chip and tool."""

    coefficient: float = described(0.5, "Coulomb's coefficient.", "0 to 2")
    shear_fraction: float = described(
        1.0, "Limit of the friction stress, as a share of the chip's shear flow stress.", "0 to 1"
    )
    thermal_exponent: Annotated[float | None, *OR_NONE] = described(
        "none",
        "Exponent q of a coefficient that falls with the temperature T of the chip's surface,\n"
        "coefficient * (1 - (T / T_melt)^q) with both in K (Moufki et al. 1998).",
        "over 0, up to 100, or none",
    )

    def build(self) -> Friction:
        """The law of friction."""
        return Friction(
            coefficient=self.coefficient,
            shear_fraction=self.shear_fraction,
            thermal_exponent=self.thermal_exponent,
        )


class SurroundingsSection(Part):
    """What free surfaces lose heat to."""

    convection: HeatTransfer = described(
        "0 W/m^2/K",
        "Coefficient of the heat transfer to the air, of all free surfaces.",
        "0 W/m^2/K to 1000000 W/m^2/K",
    )
    emissivity: float = described(
        0.0,
        "Total hemispherical emissivity with which free surfaces cool; not the camera's.",
        "0 to 1",
    )
    temperature: Temperature = described(
        "20 degC",
        "Temperature of the air and of what the surfaces radiate to.",
        "over -273.15 degC, up to 1226.85 degC",
    )

    def build(self) -> Surroundings:
        """The surroundings."""
        return Surroundings(self.convection, self.emissivity, self.temperature)


class NumericsSection(Part):
    """How finely the cut is computed."""

    cell: Length = described(
        "10 um",
        "Side of a cell of the grid; half of it takes eight times long.",
        "0.5 um to 43.75 um",
    )
    mass_scaling: float = described(
        100.0,
        "Factor on the density in the equation of motion, for longer time steps.",
        "1 to 10000",
    )
    courant: float = described(
        0.5, "Time step as a share of the time that sound takes for a cell.", "over 0, up to 0.6"
    )
    points_per_side: int = described(2, "Material points along the side of a cell.", "1 to 4")

    def build(self) -> Numerics:
        """Settings of the solver."""
        return Numerics(
            cell=self.cell,
            mass_scaling=self.mass_scaling,
            courant=self.courant,
            points_per_side=self.points_per_side,
        )


class WindowSection(Part):
    """The part of the cut that becomes the scene."""

    start: CutLength = described(
        "1.579 mm", "Length of cut at the first frame.", "over 0 mm; under end"
    )
    end: CutLength = described(
        "1.958 mm", "Length of cut at the last frame.", "over start; up to length_of_cut"
    )
    interval: Time = described(
        "0.2 us", "Time between frames.", "1 ns to 1 ms; up to the camera's integration_time"
    )
    later_bands: int = described(
        2,
        "Segments after the window of which one exposure is kept, when the shear band is\n"
        "developed, so that the headlines are drawn from several segments.",
        "0 to 1000; as many as length_of_cut leaves room for",
    )
    band_delay: float = described(
        0.22,
        "When the band is developed: this part of the time between the last two valleys of the\n"
        "cutting force after the later one.",
        "0 to 1",
    )
    band_duration: Time = described(
        "10 us",
        "How long each of them is kept.",
        "1 ns to 1 ms; the camera's integration_time or more",
    )

    def build(self) -> OutputWindow:
        """When the solver hands out frames."""
        return OutputWindow(
            start=self.start,
            end=self.end,
            interval=self.interval,
            later_bands=self.later_bands,
            band_delay=self.band_delay,
            band_duration=self.band_duration,
        )


_IN_REGION: Final = "the whole scene within the simulated region"


class FieldOfViewSection(Part):
    """Where the scene is sampled. The tip of the tool is near the origin, y points up."""

    left: Position = described("-560 um", "Left edge of the scene.", _IN_REGION)
    top: Position = described("460 um", "Upper edge of the scene.", _IN_REGION)
    spacing: Length = described(
        "2/3 um",
        "Side of a sample. A whole number of them should make camera.pitch: the paper has 9.",
        "over 0 um",
    )
    rows: int = described(810, "Samples from top to bottom.", "1 or more")
    columns: int = described(900, "Samples from left to right.", "1 or more")

    def build(self) -> Raster:
        """The grid of samples."""
        return Raster(self.left, self.top, self.spacing, self.rows, self.columns)


class CuttingSection(Part):
    """The cutting simulation; the paper's Table 2."""

    speed: Speed = described("250 m/min", "Cutting speed.", "over 0 m/min")
    feed: CutLength = described("0.3 mm", "Feed: thickness of the uncut chip.", "over 0 mm")
    length_of_cut: CutLength = described(
        "2.6 mm",
        "Length of cut, from the first contact. The paper's window ends at 1.958 mm; segments\n"
        "after it make the scatter of the headlines known.",
        "over 0 mm",
    )
    initial_temperature: Temperature = described(
        "20 degC", "Temperature before the cut.", "200 K to 1500 K"
    )
    workpiece: str = described(
        "aisi-1045",
        "Material of the workpiece. The command chipglow materials shows them.",
        f"{', '.join(material_names('workpiece'))}; with one of its sets of the\n"
        "flow stress after a slash (aisi-1045/ozel); or a file of your own (steel.yaml)",
    )
    tool: ToolSection = described({}, "The cutting tool.")
    friction: FrictionSection = described({}, "Friction between chip and tool.")
    surroundings: SurroundingsSection = described(
        {}, "What the free surfaces of chip, workpiece and tool lose heat to; nothing by default."
    )
    numerics: NumericsSection = described({}, "How finely the cut is computed.")
    window: WindowSection = described({}, "The part of the cut that becomes the scene.")
    field_of_view: FieldOfViewSection = described(
        {}, "Where the scene is sampled: the tool's tip is near the origin, y points up."
    )

    @field_validator("workpiece")
    @classmethod
    def _known(cls, name: str, info: ValidationInfo) -> str:
        if is_own_file(name):
            name = beside_the_study(name, info)
        try:
            workpiece(name)
        except OSError as error:
            raise ValueError(f"{name!r}: {error.strerror}, expected a material's file") from None
        return name

    @model_validator(mode="after")
    def _window_within_cut(self) -> Self:
        if self.window.end > self.length_of_cut * (1 + 1e-9):
            raise ValueError(
                f"window.end: {self.window.end * 1e3:g} mm is beyond length_of_cut, "
                f"expected up to {self.length_of_cut * 1e3:g} mm"
            )
        return self

    @property
    def duration(self) -> float:
        """Time in s from the first to the last frame."""
        return (self.window.end - self.window.start) / self.speed

    def build(self) -> CuttingConditions:
        """Conditions of the cut."""
        return CuttingConditions(
            speed=self.speed,
            feed=self.feed,
            length_of_cut=self.length_of_cut,
            initial_temperature=self.initial_temperature,
        )

    def simulation(self) -> CuttingSimulation:
        """The simulation that this section describes."""
        return CuttingSimulation(
            conditions=self.build(),
            tool=self.tool.build(),
            workpiece=workpiece(self.workpiece),
            tool_material=tool_material(self.tool.material),
            friction=self.friction.build(),
            numerics=self.numerics.build(),
            surroundings=self.surroundings.build(),
        )


PointOfScene = Annotated[tuple[Position, Position], Strict(False)]
Corners = Annotated[tuple[PointOfScene, ...], Strict(False)]
TableRow = Annotated[tuple[Temperature, float], Strict(False)]


class EmissivitySection(Part):
    """Emissivity of one feature."""

    mean: float = Field(description="Mean emissivity.")
    deviation: float = Field(description="Standard deviation over the surface.")

    def build(self) -> Emissivity:
        """Mean and deviation."""
        return Emissivity(self.mean, self.deviation)


def _numbers(emissivity: Emissivity) -> dict[str, float]:
    return {"mean": emissivity.mean, "deviation": emissivity.deviation}


class ChipSection(Section):
    """Emissivity of one chip."""

    body: EmissivitySection = Field(description="Body of the segments.")
    shear_band: EmissivitySection = Field(description="Shear bands: the fissures of the chip.")

    @model_validator(mode="before")
    @classmethod
    def _preset(cls, data: object) -> object:
        if not isinstance(data, str):
            return data
        preset = CHIPS[_known_name(data, CHIPS)]
        return {"body": _numbers(preset.chip), "shear_band": _numbers(preset.shear_band)}


class FeaturesSection(Section):
    """Emissivity of the features of chips: the paper's maps."""

    kind: Literal["features"] = described(
        "features",
        "What tells the emissivity: the features of a chip, each with its texture. Other kinds:\n"
        "  {kind: uniform, emissivity: 0.5}  everywhere the same\n"
        "  {kind: map, file: emissivity.nc}  an image, what chipglow emissivity writes\n"
        "  {kind: temperature, table: [[20 degC, 0.2], [1400 degC, 0.4]]}  linear between\n"
        "  {kind: phase, solid: 0.4, liquid: 0.25, solidus: 1658 K, liquidus: 1723 K}",
    )
    chips: dict[str, ChipSection] = described(
        {"chip 1": "chip-1", "chip 2": "chip-2"},
        "Chips by name, each laid on the same scene. A chip is chip-1 or chip-2 (the paper's\n"
        "Table 1), or the numbers of its body and shear bands.",
    )
    maps: dict[str, FileBeside] = described(
        {},
        "Emissivity maps by name, files of chipglow emissivity: each is laid on the scene where\n"
        "its pixels lie, as one more chip. Of several true temperatures the first counts.",
        "{} or names and files beside this one: {measured: emissivity.nc}",
    )
    workpiece: EmissivitySection = described(
        _numbers(CHIP_1.workpiece), "The uncut workpiece; the paper assumed these numbers."
    )
    tool: EmissivitySection = described(_numbers(CHIP_1.tool), "The tool's side.")
    grain: Length = described("20 um", "Size of a grain of the emissivity's texture.")
    follow: Literal["material", "mean", "none"] = described(
        "material",
        "How textures move: material (each point keeps its own), mean (the paper's shift by the\n"
        "feature's mean velocity) or none.",
    )
    restore_deviation: bool = described(
        True, "Make up for the deviation that is lost when a texture is enlarged."
    )

    @field_validator("chips")
    @classmethod
    def _at_least_one(cls, chips: dict[str, ChipSection]) -> dict[str, ChipSection]:
        if not chips:
            raise ValueError("{} is empty, expected one chip or more, such as chip 1: chip-1")
        return chips

    @model_validator(mode="after")
    def _different_names(self) -> Self:
        for name in self.maps:
            if name in self.chips:
                raise ValueError(f"maps: {name!r} is the name of a chip too, expected another")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the surfaces: the chips, then the maps."""
        return (*self.chips, *self.maps)

    def build(self, seed: int) -> dict[str, Surface]:
        """The surfaces by name.

        Parameters
        ----------
        seed : int
            Seed of the textures, the same for every chip: they differ by their numbers only.

        Raises
        ------
        ValueError
            If a file is no emissivity map.
        OSError
            If it is not there.
        """
        chips = {
            name: FeatureSurface(
                chip=chip.body.build(),
                shear_band=chip.shear_band.build(),
                workpiece=self.workpiece.build(),
                tool=self.tool.build(),
                grain=self.grain,
                follow=self.follow,
                seed=seed,
                restore_deviation=self.restore_deviation,
            )
            for name, chip in self.chips.items()
        }
        return {**chips, **{name: read_emissivity_map(file) for name, file in self.maps.items()}}


class SameSurfaceSection(Part):
    """One surface, whose kind names it."""

    kind: str = Field(description="What tells the emissivity.")

    @property
    def names(self) -> tuple[str, ...]:
        """Name of the one surface."""
        return (self.kind,)

    @abstractmethod
    def surface(self) -> Surface:
        """The surface.

        Raises
        ------
        ValueError
            If it is not possible.
        OSError
            If its file is not there.
        """

    def build(self, seed: int = 0) -> dict[str, Surface]:
        """The one surface by its name; nothing of it is random."""
        return {self.kind: self.surface()}


class UniformSection(SameSurfaceSection):
    """One emissivity."""

    kind: Literal["uniform"] = described("uniform", "Everywhere the same emissivity.")
    emissivity: float = Field(description="The emissivity.")

    def surface(self) -> Surface:
        """The surface."""
        return UniformSurface(self.emissivity)


class MapSection(SameSurfaceSection):
    """An image of emissivities."""

    kind: Literal["map"] = described("map", "An image that stays where it is.")
    file: FileBeside = Field(description="What chipglow emissivity writes.")

    def surface(self) -> Surface:
        """The surface."""
        return read_emissivity_map(self.file)


class TemperatureTableSection(SameSurfaceSection):
    """Emissivity over temperature."""

    kind: Literal["temperature"] = described("temperature", "A table over the true temperature.")
    table: Annotated[tuple[TableRow, ...], Strict(False)] = Field(
        description="Temperature and emissivity, a pair a row; linear between."
    )

    def surface(self) -> Surface:
        """The surface."""
        return TemperatureSurface(
            tuple(temperature for temperature, _ in self.table),
            tuple(emissivity for _, emissivity in self.table),
        )


class PhaseSection(SameSurfaceSection):
    """Emissivity by phase."""

    kind: Literal["phase"] = described("phase", "Solid or liquid, by the true temperature.")
    solid: float = Field(description="Emissivity up to the solidus.")
    liquid: float = Field(description="Emissivity from the liquidus on; between them linear.")
    solidus: Temperature = Field(description="Temperature at which melting begins.")
    liquidus: Temperature = Field(description="Temperature at which all is melted.")

    def surface(self) -> Surface:
        """The surface."""
        return TemperatureSurface((self.solidus, self.liquidus), (self.solid, self.liquid))


SurfaceSection = Annotated[
    FeaturesSection | UniformSection | MapSection | TemperatureTableSection | PhaseSection,
    Field(discriminator="kind"),
]


class AnnularApertureSection(Part):
    """Diffraction of a reflecting microscope objective."""

    kind: Literal["annular-aperture"] = described(
        "annular-aperture",
        "Diffraction of a reflecting microscope objective. Other kinds:\n"
        "  {kind: airy, f_number: 2.5}  or numerical_aperture: a round aperture\n"
        "  {kind: gaussian, fwhm: 12 um}  full width at half maximum\n"
        "  {kind: measured, file: psf.npy, spacing: 1 um}  .npy or .csv, side of its samples\n"
        "  {kind: measured, file: psf.nc}  what chipglow psf writes",
    )
    wavelength: Wavelength = described("4.5 um", "Wavelength of the diffraction.")
    numerical_aperture: float = described(0.28, "Numerical aperture of the objective.")
    obscuration: float = described(0.35, "Diameter of the central obstruction, as a share.")

    def build(self) -> PointSpreadFunction:
        """The point spread function."""
        return AnnularAperturePSF(self.wavelength, self.numerical_aperture, self.obscuration)


class AirySection(Part):
    """Diffraction of a round aperture, by the data sheet of a lens."""

    kind: Literal["airy"] = described("airy", "Diffraction of a round aperture.")
    wavelength: Annotated[Wavelength | None, *OR_NONE] = described(
        "none", "Wavelength of the diffraction; none: the middle of the camera's band."
    )
    numerical_aperture: Annotated[float | None, *OR_NONE] = described(
        "none", "Numerical aperture on the scene's side.", "over 0, up to 1, or none"
    )
    f_number: Annotated[float | None, *OR_NONE] = described(
        "none",
        "F-number of the lens, focused at infinity; with the camera's magnification m the\n"
        "numerical aperture is m / (2 f_number (1 + m)).",
        "over 0, or none",
    )

    def build(self) -> PointSpreadFunction:
        """The point spread function of a camera of 4.5 um at a magnification of 1."""
        return self.psf(4.5e-6, 1.0)

    def psf(self, middle: float, magnification: float) -> PointSpreadFunction:
        """The point spread function.

        Parameters
        ----------
        middle : float
            Middle of the camera's band in m.
        magnification : float
            Of the camera's lens.
        """
        given = (self.numerical_aperture, self.f_number)
        if (given[0] is None) == (given[1] is None):
            raise ValueError("expected one of numerical_aperture and f_number")
        aperture = self.numerical_aperture
        if self.f_number is not None:
            if not self.f_number > 0:
                raise ValueError(f"f_number: {self.f_number:g}, expected over 0")
            aperture = magnification / (2 * self.f_number * (1 + magnification))
        assert aperture is not None
        return AnnularAperturePSF(self.wavelength or middle, aperture, 0.0)


class GaussianSection(Part):
    """A Gaussian."""

    kind: Literal["gaussian"] = described("gaussian", "A Gaussian.")
    fwhm: Length = Field(description="Full width at half maximum.")

    def build(self) -> PointSpreadFunction:
        """The point spread function."""
        return GaussianPSF(self.fwhm)


class MeasuredSection(Part):
    """A kernel from a file."""

    kind: Literal["measured"] = described("measured", "A kernel from a file.")
    file: FileBeside = Field(description="File of the kernel, .npy, .csv or .nc.")
    spacing: Annotated[Length | None, *OR_NONE] = described(
        "none",
        "Side of the kernel's samples; none for a .nc, which tells it.",
        "none, or over 0 um",
    )

    def build(self) -> PointSpreadFunction:
        """The point spread function."""
        try:
            return MeasuredPSF.from_file(self.file, self.spacing)
        except OSError as error:
            raise ValueError(f"file: {self.file}: {error.strerror}") from None


PSFSection = Annotated[
    AnnularApertureSection | AirySection | GaussianSection | MeasuredSection,
    Field(discriminator="kind"),
]


class CameraSection(Part):
    """The infrared camera."""

    band: WavelengthRange = described("3.8-5.1 um", "Spectral band.")
    response: Annotated[FileBeside | None, *OR_NONE] = described(
        "none",
        "Relative spectral response, a CSV file: its first line wavelength_um,response, then a\n"
        "point a line; it counts within the band.",
        "none, or a file such as response.csv",
    )
    pitch: Length = described("6 um", "Distance between sensors, as seen on the scene.")
    detector_pitch: Annotated[Length | None, *OR_NONE] = described(
        "none",
        "The same on the detector, of its data sheet, in the place of pitch; with magnification.",
        "none, or over 0 um",
    )
    magnification: Annotated[float | None, *OR_NONE] = described(
        "none",
        "Of the lens: a pitch of 15 um at 2.5 is 6 um on the scene.",
        "none, or over 0",
    )
    array: Annotated[tuple[int, int] | None, Strict(False), *OR_NONE] = described(
        "none",
        "Columns and rows of the detector; none, and where the scene is smaller: as many as see\n"
        "the scene.",
        "none, or such as [640, 512]",
    )
    fill_factor: float = described(1.0, "Share of a sensor's square that takes light.")
    offset_right: Position = described("0 um", "First sensor's corner from the scene's left edge.")
    offset_down: Position = described("0 um", "First sensor's corner from the scene's upper edge.")
    psf: Annotated[PSFSection | None, *OR_NONE] = described(
        {"kind": "annular-aperture"},
        "Point spread function of the optics, or none.",
    )
    psf_order: Literal["optics", "sensor"] = described(
        "sensor",
        "sensor (the paper's: on the sensors' values) or optics (on the samples, before the\n"
        "sensors integrate).",
    )
    integration_time: Time = described("10 us", "Exposure.")
    frame_rate: Frequency = described("600 Hz", "Frames a second.")
    floor: Annotated[Temperature | None, *OR_NONE] = described(
        "300 degC", "Radiance temperatures under this are flagged, not returned; or none."
    )
    reflected: Annotated[Temperature | None, *OR_NONE] = described(
        "none", "Temperature of the surroundings that the surface reflects, or none."
    )

    @model_validator(mode="before")
    @classmethod
    def _pitch_on_the_scene(cls, data: object) -> object:
        return with_pitch(data) if isinstance(data, Mapping) else data

    def build(self) -> Camera:
        """The camera, with as many sensors as see the scene."""
        response = None if self.response is None else read_response(self.response)
        return Camera(
            band=Band(*self.band, response),
            pitch=self.pitch,
            offset=(self.offset_right, self.offset_down),
            fill_factor=self.fill_factor,
            psf=self._psf(),
            psf_order=self.psf_order,
            integration_time=self.integration_time,
            frame_rate=self.frame_rate,
            floor=self.floor,
            reflected=self.reflected,
        )

    def on(self, scene: Raster) -> Camera:
        """The camera on a scene, with no more sensors than its detector has.

        Parameters
        ----------
        scene : Raster
            The scene's samples.
        """
        camera = self.build()
        if self.array is None:
            return camera
        seen = camera.sensors(scene)
        columns, rows = self.array
        return replace(camera, shape=(min(rows, seen.rows), min(columns, seen.columns)))

    def _psf(self) -> PointSpreadFunction | None:
        if isinstance(self.psf, AirySection):
            if self.psf.f_number is not None and self.magnification is None:
                raise ValueError("magnification: is missing, expected it with psf.f_number")
            return self.psf.psf(sum(self.band) / 2, self.magnification or 1.0)
        return None if self.psf is None else self.psf.build()


class AnalysisSection(Part):
    """What is computed from the simulated measurement."""

    instants: int = described(9, "Exposures, spread evenly over the scene.")
    phases: int = described(
        3,
        "Positions of the pixels along each axis, evenly over a pixel, on which each headline is\n"
        "drawn anew: 3 makes 9.",
        "1 or more",
    )
    textures: int = described(
        5,
        "Textures of the emissivity on which each headline is drawn anew: of the study's seed and\n"
        "those after it.",
        "1 or more",
    )
    rake_chip: str = described(
        "chip 2", "Chip whose errors are read at the rake face; the paper took its chip 2."
    )
    band_chip: str = described(
        "chip 1", "Chip whose errors are read at the shear band; the paper took its chip 1."
    )
    reference: Literal["maximum", "mean", "centre", "true"] = described(
        "maximum",
        "What a pixel's measured temperature is compared with, in its square during the exposure:\n"
        "the greatest radiance temperature (maximum, the paper's), that of the mean radiance\n"
        "(mean), that in the middle of both (centre) or the greatest true temperature (true).",
    )
    psf_widths: Annotated[tuple[Length, ...], Strict(False)] = described(
        [f"{width} um" for width in range(4, 21)],
        "Full widths at half maximum of Gaussians for which the headline errors are shown.",
    )

    points: dict[str, PointOfScene] = described(
        {},
        "Points by name where the error is read, in the place of rake face and shear band.",
        "{} or positions: {middle of the pool: [0 um, -20 um]}",
    )
    lines: dict[str, Corners] = described(
        {},
        "Lines by name, from corner to corner.",
        "{} or positions: {across: [[-100 um, 0 um], [100 um, 0 um]]}",
    )
    regions: dict[str, RegionSection] = described(
        {},
        "Regions by name: a polygon, a rectangle or a circle.",
        "{} or {pad: {rectangle: [[0 um, 0 um], [100 um, -50 um]]}}; also\n"
        "{circle: {centre: [0 um, 0 um], radius: 20 um}}",
    )

    @field_validator("reference", mode="before")
    @classmethod
    def _true_is_a_word(cls, reference: object) -> object:
        return "true" if reference is True else reference  # YAML reads it as a truth value

    @property
    def places(self) -> tuple[Place, ...]:
        """Where the user wants the error to be read."""
        return (
            *(PointPlace(name, point) for name, point in self.points.items()),
            *(LinePlace(name, corners) for name, corners in self.lines.items()),
            *(RegionPlace(name, one.region(name)) for name, one in self.regions.items()),
        )

    def scene_plan(self) -> ScenePlan:
        """What to analyse of a scene that is no cut, or at the user's places."""
        return ScenePlan(
            places=self.places,
            instants=self.instants,
            phases=self.phases,
            textures=self.textures,
            reference=self.reference,
        )

    @model_validator(mode="after")
    def _possible_places(self) -> Self:
        self.scene_plan()
        return self

    def build(self) -> Plan:
        """What to analyse."""
        return Plan(
            instants=self.instants,
            phases=self.phases,
            textures=self.textures,
            rake_surface=self.rake_chip,
            band_surface=self.band_chip,
            psf_widths=self.psf_widths,
            reference=self.reference,
        )


class Study(Section):
    """A study: the paper's by default.

    Sections take what a YAML file would give: text with units, or plain numbers where there is no
    unit. Values are held in SI.

    Raises
    ------
    pydantic.ValidationError
        If a field is unknown or its value impossible; a ValueError.

    Examples
    --------
    >>> study = Study(camera={"pitch": "5 um"})
    >>> study.camera.pitch
    5e-06
    """

    title: str = described(
        "The effects of emissivity and camera point spread function (Heigel and Whitenton 2010)",
        "What the report is headed with.",
    )
    seed: int = described(2010, "Seed of all random numbers.")
    scene: Annotated[FileBeside | None, *OR_NONE] = described(
        "none",
        "File of a scene that takes the place of the cut, such as one of chipglow import. Its own\n"
        "times and samples count; of the section cutting only the tool, if the scene has none.",
        "none, or a file beside this one: scene.nc",
    )
    cutting: CuttingSection = described(
        {}, "The cutting simulation; defaults: the paper's Table 2."
    )
    surface: SurfaceSection = described(
        {"kind": "features"}, "Emissivities; defaults: the paper's Table 1."
    )
    camera: CameraSection = described({}, "The infrared camera.")
    analysis: AnalysisSection = described({}, "What is computed from the simulated measurement.")

    @property
    def plan(self) -> Plan:
        """What to analyse of a cut; a surface that is the only one is seen everywhere."""
        plan = replace(self.analysis.build(), beside_paper=self.is_papers)
        if isinstance(self.surface, FeaturesSection):
            return plan
        (name,) = self.surface.names
        return replace(plan, rake_surface=name, band_surface=name)

    @property
    def is_papers(self) -> bool:
        """Whether it cuts, looks and reads as the paper does: its figures may stand beside it.

        How finely it is computed, and how often drawn, does not matter.
        """
        paper, finely = type(self)(), {"numerics", "window", "field_of_view", "length_of_cut"}
        return (
            self.scene is None
            and self.cutting.model_dump(exclude=finely) == paper.cutting.model_dump(exclude=finely)
            and self.surface == paper.surface
            and self.camera == paper.camera
            and self.analysis.reference == paper.analysis.reference
        )

    @classmethod
    def quick(cls) -> Self:
        """The paper's study on a coarse cell and coarse samples, for a first look and for tests."""
        return cls.model_validate(
            {
                "title": "Quick look at the study of Heigel and Whitenton (2010)",
                "cutting": {
                    "numerics": {"cell": "20 um"},
                    "window": {"interval": "0.5 us", "later_bands": 1},
                    "field_of_view": {"spacing": "1.5 um", "rows": 360, "columns": 400},
                },
                "analysis": {
                    "instants": 5,
                    "phases": 2,
                    "textures": 2,
                    "psf_widths": ["4 um", "8 um", "12 um", "20 um"],
                },
            }
        )

    @field_validator("seed")
    @classmethod
    def _not_negative(cls, seed: int) -> int:
        if seed < 0:
            raise ValueError(f"{seed} is negative, expected 0 or more")
        return seed

    @model_validator(mode="before")
    @classmethod
    def _scaled(cls, data: object) -> object:
        return scaled(data) if isinstance(data, Mapping) else data

    @field_validator("surface", mode="before")
    @classmethod
    def _features_by_default(cls, surface: object) -> object:
        if surface is None:
            return {"kind": "features"}
        if isinstance(surface, Mapping) and "kind" not in surface:
            return {"kind": "features", **surface}
        return surface

    @model_validator(mode="after")
    def _chips_are_there(self) -> Self:
        if not isinstance(self.surface, FeaturesSection):
            return self
        for field in ("rake_chip", "band_chip"):
            name = getattr(self.analysis, field)
            if name not in self.surface.names:
                known = ", ".join(self.surface.names)
                raise ValueError(f"analysis.{field}: {name!r} is unknown, expected one of {known}")
        return self

    @model_validator(mode="after")
    def _camera_fits_scene(self) -> Self:
        if self.scene is not None:
            return self
        camera, cutting = self.camera, self.cutting
        if camera.integration_time > cutting.duration:
            raise ValueError(
                f"camera.integration_time: {camera.integration_time * 1e6:g} us is longer than the "
                f"scene, expected up to the {cutting.duration * 1e6:.4g} us of cutting.window"
            )
        if cutting.window.interval > camera.integration_time:
            raise ValueError(
                f"cutting.window.interval: {cutting.window.interval * 1e6:g} us is longer than the "
                f"exposure, expected up to {camera.integration_time * 1e6:g} us"
            )
        window = cutting.window
        if window.later_bands and window.band_duration < camera.integration_time * (1 - 1e-9):
            raise ValueError(
                f"cutting.window.band_duration: {window.band_duration * 1e6:g} us is shorter than "
                f"the exposure, expected {camera.integration_time * 1e6:g} us or more"
            )
        view = cutting.field_of_view
        extent = view.spacing * min(view.rows, view.columns)
        if camera.pitch > extent * (1 + 1e-9):
            raise ValueError(
                f"camera.pitch: {camera.pitch * 1e6:g} um is larger than the field of view, "
                f"expected up to the {extent * 1e6:g} um of cutting.field_of_view"
            )
        return self


def _known_name(name: str, names: Mapping[str, object]) -> str:
    if name not in names:
        raise ValueError(f"{name!r} is unknown, expected one of {', '.join(names)}")
    return name
