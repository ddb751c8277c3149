"""What is cut and how: speed, feed, friction; when to look; how finely to compute."""

from dataclasses import dataclass
from math import isfinite


@dataclass(frozen=True)
class CuttingConditions:
    """Orthogonal cut; Table 2 of Heigel and Whitenton (2010) by default.

    Parameters
    ----------
    speed : float
        Cutting speed in m/s.
    feed : float
        Uncut chip thickness in m.
    length_of_cut : float
        In m; the paper's window ends at 1.958 mm.
    initial_temperature : float
        Of workpiece and tool, in K.
    """

    speed: float = 250.0 / 60.0
    feed: float = 0.3e-3
    length_of_cut: float = 2.6e-3
    initial_temperature: float = 293.15

    def __post_init__(self) -> None:
        for name, unit in (("speed", "m/s"), ("feed", "m"), ("length_of_cut", "m")):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0):
                raise ValueError(f"{name}: expected over 0 {unit}, got {value!r} {unit}")
        if not 200.0 <= self.initial_temperature <= 1500.0:
            raise ValueError(
                f"initial_temperature: expected 200 K to 1500 K, got {self.initial_temperature!r} K"
            )


@dataclass(frozen=True)
class Friction:
    """Friction of Zorev's kind: Coulomb, limited by the shear strength of the chip.

    With a `thermal_exponent` q the coefficient falls with the temperature T of the chip's surface,
    as Moufki, Molinari and Dudzinski (1998), J. Mech. Phys. Solids 46, 2103 proposed for the mean
    temperature of the contact: μ = μ₀ (1 − (T/T_melt)^q), 0 from T_melt on. The form is as widely
    cited, the paper was not seen. T and T_melt, that of the flow stress, are in K here.

    Parameters
    ----------
    coefficient : float
        Coulomb coefficient; with a `thermal_exponent` that at 0 K, μ₀.
    shear_fraction : float
        Limit of the friction stress as a share of the chip's shear flow stress.
    conductance : float
        Thermal conductance of the contact in W/(m² K).
    thermal_exponent : float, optional
        q; without one the coefficient does not depend on the temperature.
    """

    coefficient: float = 0.5
    shear_fraction: float = 1.0
    conductance: float = 1e7
    thermal_exponent: float | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.coefficient <= 2:
            raise ValueError(f"friction coefficient: expected 0 to 2, got {self.coefficient!r}")
        if not 0 <= self.shear_fraction <= 1:
            raise ValueError(f"shear_fraction: expected 0 to 1, got {self.shear_fraction!r}")
        if not 0 <= self.conductance < 1e12:
            raise ValueError(
                f"contact conductance: expected 0 to 1e12 W/(m2 K), got {self.conductance!r}"
            )
        exponent = self.thermal_exponent
        if exponent is not None and not 0 < exponent <= 100:
            raise ValueError(
                f"friction thermal_exponent: expected over 0 and up to 100, got {exponent!r}"
            )


@dataclass(frozen=True)
class Surroundings:
    """What the free surfaces of chip, workpiece and tool lose heat to; nothing by default.

    Parameters
    ----------
    convection : float
        Coefficient of heat transfer in W/(m² K).
    emissivity : float
        Total hemispherical emissivity, of all surfaces. It only cools: what the camera sees is
        the surface's own affair.
    temperature : float
        Of the air and of what the surfaces radiate to, in K.
    """

    convection: float = 0.0
    emissivity: float = 0.0
    temperature: float = 293.15

    def __post_init__(self) -> None:
        if not 0 <= self.convection <= 1e6:
            raise ValueError(
                f"surroundings convection: expected 0 to 1e6 W/(m2 K), got {self.convection!r}"
            )
        if not 0 <= self.emissivity <= 1:
            raise ValueError(f"surroundings emissivity: expected 0 to 1, got {self.emissivity!r}")
        if not 0 < self.temperature <= 1500:
            raise ValueError(
                "surroundings temperature: expected over 0 K and up to 1500 K, "
                f"got {self.temperature!r} K"
            )


@dataclass(frozen=True)
class OutputWindow:
    """The part of the cut that is recorded; the paper's by default.

    Parameters
    ----------
    start, end : float
        Lengths of cut in m between which frames are recorded.
    interval : float
        Time between frames in s.
    later_bands : int
        How many segments after the window are recorded too, each for one exposure when its shear
        band is developed.
    band_delay : float
        When that is: so much of the time between the last two valleys of the cutting force after
        the later one. By the solver's own cuts the band is hottest 0.2 to 0.25 of that time after
        the valley; then its temperature stays within 5 K for an exposure's 10 µs.
    band_duration : float
        How long each of these bands is recorded in s.
    """

    start: float = 1.579e-3
    end: float = 1.958e-3
    interval: float = 0.2e-6
    later_bands: int = 0
    band_delay: float = 0.22
    band_duration: float = 10e-6

    def __post_init__(self) -> None:
        if not 0 <= self.start < self.end < 1:
            raise ValueError(
                f"window: expected 0 <= start < end in m, got {self.start!r} and {self.end!r}"
            )
        if not 1e-9 <= self.interval <= 1e-3:
            raise ValueError(f"window interval: expected 1 ns to 1 ms, got {self.interval!r} s")
        if not 0 <= self.later_bands <= 1000:
            raise ValueError(f"window later_bands: expected 0 to 1000, got {self.later_bands!r}")
        if not 0 <= self.band_delay <= 1:
            raise ValueError(f"window band_delay: expected 0 to 1, got {self.band_delay!r}")
        if not 1e-9 <= self.band_duration <= 1e-3:
            raise ValueError(
                f"window band_duration: expected 1 ns to 1 ms, got {self.band_duration!r} s"
            )


@dataclass(frozen=True)
class Numerics:
    """How finely the cut is computed.

    Parameters
    ----------
    cell : float
        Side of a cell of the grid in m.
    mass_scaling : float
        Factor on the density in the equation of motion. Cutting is slow against the speed of
        sound, so a heavier material moves alike and allows a longer time step; heat is not scaled.
    courant : float
        Time step as a share of the time in which sound crosses a cell.
    points_per_side : int
        Material points along the side of a cell.
    upstream, downstream, depth, height : float
        Extent of the computed region in m: before and behind the edge, under and over the cut.
    """

    cell: float = 10e-6
    mass_scaling: float = 100.0
    courant: float = 0.5
    points_per_side: int = 2
    upstream: float = 0.75e-3
    downstream: float = 0.55e-3
    depth: float = 0.35e-3
    height: float = 1.2e-3

    def __post_init__(self) -> None:
        if not 0.5e-6 <= self.cell <= 1e-4:
            raise ValueError(f"cell: expected 0.5 um to 100 um, got {self.cell * 1e6:g} um")
        if not 1 <= self.mass_scaling <= 1e4:
            raise ValueError(f"mass_scaling: expected 1 to 10000, got {self.mass_scaling!r}")
        if not 0 < self.courant <= 0.6:
            raise ValueError(f"courant: expected over 0 and up to 0.6, got {self.courant!r}")
        if not 1 <= self.points_per_side <= 4:
            raise ValueError(f"points_per_side: expected 1 to 4, got {self.points_per_side!r}")
        for name in ("upstream", "downstream", "depth", "height"):
            if not 8 * self.cell <= getattr(self, name) <= 0.1:
                raise ValueError(f"{name}: expected 8 cells to 0.1 m, got {getattr(self, name)!r}")
