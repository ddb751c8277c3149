"""The settings of a study: its sections, with the paper's as defaults, and checks across them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from html import escape
from typing import Annotated, Any, Self

from chipglow.analysis import AttributionPlan, CorrectionPlan, Plan, WavelengthPlan
from chipglow.camera import AnnularAperturePSF
from chipglow.quantities import ROUNDING, SEED, FileBeside, Parameter, Part, changed
from chipglow.study.camera_section import CameraSection
from chipglow.study.cutting_section import STEADY, CuttingSection
from chipglow.study.scaling import resolved
from chipglow.study.surface_section import FeaturesSection, SurfaceSection, surface_names
from chipglow.study.uncertainty_section import UncertaintySection
from chipglow.text import commented_yaml


@dataclass(frozen=True)
class Study(Part):
    """A study: the paper's by default.

    Sections take what a YAML file would give: text with units, or plain numbers where there is no
    unit. Values are held in SI.

    Raises
    ------
    ValueError
        If a key of a section is unknown or a value impossible.

    Examples
    --------
    >>> study = Study(camera={"pitch": "5 um"})
    >>> study.camera.pitch
    5e-06
    """

    title: Annotated[str, Parameter("Title of the report.")] = (
        "Reproduction of Heigel and Whitenton (2010) by chipglow"
    )
    seed: Annotated[int, Parameter("Seed of all random numbers.", least=0)] = SEED
    scene: Annotated[
        FileBeside | None,
        Parameter(
            "Scene file to measure instead of a cut, such as the output of chipglow import. The "
            "section cutting is then ignored, except for its tool if the scene has none.",
            allowed="none, or a file beside this one: scene.nc",
        ),
    ] = None
    cutting: Annotated[
        CuttingSection, Parameter("The cutting simulation; defaults: the paper's Table 2.")
    ] = field(default_factory=CuttingSection)
    surface: Annotated[
        SurfaceSection, Parameter("Emissivities; defaults: the paper's Table 1.")
    ] = field(default_factory=FeaturesSection)
    camera: Annotated[CameraSection, Parameter("The infrared camera.")] = field(
        default_factory=CameraSection
    )
    analysis: Annotated[Plan, Parameter("Numbers to compute from the simulated measurement.")] = (
        field(default_factory=Plan)
    )

    attribution: Annotated[
        AttributionPlan | None,
        Parameter("Effects among which the error of each pixel is divided; none: it is not."),
    ] = field(default_factory=AttributionPlan)

    correction: Annotated[
        bool,
        Parameter(
            "Whether the report of a cut corrects rake face and shear band for all known effects. "
            "Standard uncertainties are taken from uncertainty.inputs, else from the heated chip."
        ),
    ] = True

    wavelengths: Annotated[
        WavelengthPlan, Parameter("Bands that chipglow wavelengths compares, alone and as ratios.")
    ] = field(default_factory=WavelengthPlan)

    uncertainty: Annotated[
        UncertaintySection, Parameter("Input quantities of the budget of chipglow budget.")
    ] = field(default_factory=UncertaintySection)

    def _repr_html_(self) -> str:
        text = escape(commented_yaml("", self, set()))
        return f"<details><summary>{escape(self.title)}</summary><pre>{text}</pre></details>"

    @property
    def plan(self) -> Plan:
        """The plan of the analysis, with PSF widths around the camera's."""
        plan = self.analysis
        psf = self.camera.build().psf
        ratio = 1.0 if psf is None else psf.fwhm / AnnularAperturePSF().fwhm
        if "psf_widths" not in self.analysis.given and ratio != 1.0:
            widths = [float(f"{ratio * width:.3g}") for width in plan.psf_widths]
            plan = replace(plan, psf_widths=tuple(widths))
        if isinstance(self.surface, FeaturesSection):
            return plan
        (name,) = surface_names(self.surface)
        return replace(plan, rake_chip=name, band_chip=name)

    @property
    def known(self) -> CorrectionPlan | None:
        """Knowledge of a correction: uncertainties of emissivity and PSF width, by the budget."""
        if not self.correction:
            return None
        inputs = {one.name: one for one in self.uncertainty.build(self).inputs}
        width = inputs.get("camera.psf.fwhm", inputs.get("camera.psf.numerical_aperture"))
        emissivity = {}
        for surface in surface_names(self.surface):
            paths = f"surface.chips.{surface}.body.mean", "surface.emissivity"
            for path in paths:
                if path in inputs:
                    emissivity[surface] = inputs[path].standard_uncertainty
        return CorrectionPlan(
            emissivity, 0.0 if width is None else width.standard_uncertainty / width.value
        )

    def with_steady_tool(self) -> Self:
        """Return the same study with a tool at steady-state temperature."""
        title = f"{self.title}, with a tool at steady-state temperature"
        return changed(self, {"title": title, "cutting.tool.temperature": STEADY})

    @property
    def is_papers(self) -> bool:
        """Whether it cuts, measures and reads as the paper does, finely or coarsely.

        The temperature of its tool does not count: it was not measured.
        """
        paper = type(self)()
        names = ("numerics", "window", "field_of_view", "cutting_length")
        finely = {name: getattr(paper.cutting, name) for name in names}
        tool = replace(self.cutting.tool, temperature=paper.cutting.tool.temperature)
        return (
            self.scene is None
            and replace(self.cutting, tool=tool, **finely) == paper.cutting
            and self.surface == paper.surface
            and self.camera == paper.camera
            and self.analysis.reference == paper.analysis.reference
        )

    @classmethod
    def quick(cls) -> Self:
        """Return the paper's study on a coarse cell and coarse samples."""
        title = "Quick reproduction of Heigel and Whitenton (2010) by chipglow"
        cutting = {
            "window": {"interval": "0.5 us", "later_bands": 1},
            "field_of_view": {"spacing": "1.5 um", "rows": 520, "columns": 460},
        }
        widths = ["4 um", "8 um", "12 um", "20 um"]
        draws = {"exposures": 5, "phases": 4, "textures": 2, "psf_widths": widths}
        paths = {f"cutting.{path}": value for path, value in cutting.items()}
        return changed(cls(), {"title": title, **paths, "analysis": draws})

    @classmethod
    def completed(cls, data: Any) -> Any:
        """Return the data with the surface's usual kind."""
        if not isinstance(data, Mapping):
            return data
        surface = data.get("surface")
        if isinstance(surface, Mapping) or (surface is None and "surface" in data):
            return {**data, "surface": {"kind": "features", **(surface or {})}}
        return data

    def __post_init__(self) -> None:
        super().__post_init__()
        self._resolve_cutting()
        if isinstance(self.surface, FeaturesSection):
            self._check_chips()
        if self.scene is None:
            self._check_camera()

    def _resolve_cutting(self) -> None:
        """Set what follows from feed, rake angle, speed and camera, if the scene is a cut."""
        try:
            if self.scene is None:
                object.__setattr__(self, "cutting", resolved(self.cutting, self.camera))
                object.__setattr__(self, "given", self.given | {"cutting"})
            self.cutting.check_window()
        except ValueError as error:
            raise ValueError(f"cutting.{error}") from None

    def _check_chips(self) -> None:
        for name in ("rake_chip", "band_chip"):
            chip, known = getattr(self.analysis, name), surface_names(self.surface)
            if chip not in known:
                raise ValueError(
                    f"analysis.{name}: {chip!r} is unknown, expected one of {', '.join(known)}"
                )

    def _check_camera(self) -> None:
        camera, cutting, window = self.camera, self.cutting, self.cutting.window
        if camera.integration_time > cutting.duration:
            raise ValueError(
                f"camera.integration_time: {camera.integration_time * 1e6:g} us is longer than the "
                f"scene, expected up to the {cutting.duration * 1e6:.4g} us of cutting.window"
            )
        if window.interval > camera.integration_time:
            raise ValueError(
                f"cutting.window.interval: {window.interval * 1e6:g} us is longer than the "
                f"exposure, expected up to {camera.integration_time * 1e6:g} us"
            )
        if window.later_bands and window.band_duration < camera.integration_time * (1 - ROUNDING):
            raise ValueError(
                f"cutting.window.band_duration: {window.band_duration * 1e6:g} us is shorter than "
                f"the exposure, expected {camera.integration_time * 1e6:g} us or more"
            )
        view = cutting.field_of_view
        extent = view.spacing * min(view.rows, view.columns)
        if camera.pitch > extent * (1 + ROUNDING):
            raise ValueError(
                f"camera.pitch: {camera.pitch * 1e6:g} um is larger than the field of view, "
                f"expected up to the {extent * 1e6:g} um of cutting.field_of_view"
            )
