"""Units by name: definitions of the SI and of NIST SP 811, spellings, and what is refused."""

from math import pi

import pytest

from chipglow.quantities.units import (
    CONDUCTIVITY,
    HEAT_CAPACITY,
    LENGTH,
    STRESS,
    TEMPERATURE,
    parse_unit,
)


@pytest.mark.parametrize(
    ("text", "base", "scale", "offset"),
    [
        # Exact by definition: the inch, the pound, standard gravity, and the calorie of chemistry.
        ("inch", "m", 0.0254, 0.0),
        ("ft", "m", 0.3048, 0.0),
        ("thou", "m", 25.4e-6, 0.0),
        ("lbf", "N", 0.45359237 * 9.80665, 0.0),
        ("psi", "Pa", 0.45359237 * 9.80665 / 0.0254**2, 0.0),
        ("ksi", "Pa", 1e3 * 0.45359237 * 9.80665 / 0.0254**2, 0.0),
        ("lbf/inch^2", "Pa", 0.45359237 * 9.80665 / 0.0254**2, 0.0),
        ("cal/(g K)", "J/kg/K", 4184.0, 0.0),
        ("erg/cm2", "J/m^2", 1e-3, 0.0),
        ("atm", "Pa", 101325.0, 0.0),
        ("degF", "K", 5 / 9, 459.67 * 5 / 9),
        ("degR", "K", 5 / 9, 0.0),
        ("degC", "K", 1.0, 273.15),
        ("cK", "K", 0.01, 0.0),
        ("deg", "rad", pi / 180, 0.0),
        ("arcmin", "rad", pi / 10800, 0.0),
        # Derived units by their parts.
        ("N/mm2", "Pa", 1e6, 0.0),
        ("W", "J/s", 1.0, 0.0),
        ("V^2/ohm", "W", 1.0, 0.0),
        ("uohm cm", "ohm*m", 1e-8, 0.0),
        ("km/h", "m/s", 1 / 3.6, 0.0),
        ("kHz", "1/s", 1e3, 0.0),
        # Without a zero of its own, a degree is a difference of temperatures.
        ("W/(m degC)", "W/m/K", 1.0, 0.0),
        ("BTU/(lb degF)", "J/kg/K", 1055.056 / 0.45359237 * 1.8, 0.0),
    ],
)
def test_a_unit_is_its_definition(text, base, scale, offset):
    found = parse_unit(text, base, "field")
    # A decimal and a product of doubles: some roundings of 1e-16.
    assert (found.scale, found.offset) == pytest.approx((scale, offset), rel=1e-15)


@pytest.mark.parametrize(
    ("quantity", "texts"),
    [
        (LENGTH, ("3 um", "3 µm", "3 μm", "3 micron", "3 microns", "3e-3 mm", "3000 nanometers")),
        (LENGTH, ("25.4 mm", "1 inch", "1 in", "2.54 centimetres", "1000 thou")),
        (STRESS, ("300 MPa", "0.3 GPa", "300 N/mm^2", "300 N mm-2", "300 megapascals", "3 kbar")),
        (CONDUCTIVITY, ("45 W/m/K", "45 W/(m K)", "45 W m-1 K-1", "0.45 W/cm/K")),
        (HEAT_CAPACITY, ("480 J/kg/K", "0.48 kJ/(kg K)", "0.48 J g^-1 K^-1")),
        (TEMPERATURE, ("300 degC", "573.15 K", "300 °C", "300 celsius", "572 degF")),
    ],
)
def test_spellings_of_one_value_are_the_same_double(quantity, texts):
    assert len({quantity.parse(text) for text in texts}) == 1


@pytest.mark.parametrize(
    ("text", "base"),
    [
        ("kg", "m"), ("m/s", "m"), ("rpm", "Hz"), ("kmin", "s"), ("kkm", "m"), ("mum", "m"),
        ("s m", "m"), ("m2", "m"), ("M", "m"), ("ks s", "s"), ("u", "m"), ("m/", "m"), ("", "m"),
    ],
)  # fmt: skip
def test_what_is_no_unit_of_the_quantity_is_refused(text, base):
    with pytest.raises(ValueError, match=f"of field, expected a unit such as {base}"):
        parse_unit(text, base, "field")
