"""What to analyse."""

from dataclasses import dataclass, field

from chipglow.analysis.images import ReferenceKind
from chipglow.analysis.places import Place


@dataclass(frozen=True)
class Plan:
    """What to analyse of a scene.

    Parameters
    ----------
    exposures : int
        Number of exposures, spread evenly over the scene's longest part without a gap.
    phases, textures : int
        How many values each reading is drawn for: positions of the pixels along each axis (3 makes
        9), and textures of the emissivity.
    rake_surface, band_surface : str
        Names of the surfaces whose errors are read at the rake face (the paper: chip 2) and at
        the shear band (the paper: chip 1) of a cut.
    psf_widths : tuple of float
        Full widths at half maximum of the point spread functions that are compared on a cut, in m.
    reference : {"maximum", "mean", "centre", "true"}
        What the measured temperatures are compared with.
    places : tuple of Place
        Where the error is read, instead of the rake face and the shear band of a cut.
    cut : bool
        Whether a scene that shows a cut is analysed segment by segment, at the rake face and the
        shear band. Otherwise the scene is analysed exposure by exposure.
    line_reach, line_step : float
        Reach of the lines across rake face and shear band to either side, and distance between
        their points, in m.
    touching : float
        Distance from the rake face in m within which material counts as touching it; by default
        half the paper's pixel.

    Raises
    ------
    ValueError
        If a number is not positive, there are no widths, or two places have the same name.
    """

    exposures: int = 9
    phases: int = 3
    textures: int = 5
    rake_surface: str = "chip 2"
    band_surface: str = "chip 1"
    psf_widths: tuple[float, ...] = field(
        default_factory=lambda: tuple(width * 1e-6 for width in range(4, 21))
    )
    reference: ReferenceKind = "maximum"
    places: tuple[Place, ...] = ()
    cut: bool = True
    line_reach: float = 60e-6
    line_step: float = 1e-6
    touching: float = 3e-6

    def __post_init__(self) -> None:
        for name in ("exposures", "phases", "textures", "line_reach", "line_step", "touching"):
            if not getattr(self, name) > 0:
                raise ValueError(f"plan: {name} is {getattr(self, name)!r}, expected over 0")
        if not self.psf_widths or min(self.psf_widths) <= 0:
            raise ValueError(f"plan: psf_widths is {self.psf_widths!r}, expected lengths over 0 m")
        names = [place.name for place in self.places]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"plan: two places have the name {name!r}, expected unique names")
