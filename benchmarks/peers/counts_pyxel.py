"""Counts of a surface by the models of Pyxel 3, without its runner, for `camera_pass.py`."""

from pyxel.detectors import CMOS, Characteristics, CMOSGeometry, Environment
from pyxel.models.charge_collection import simple_collection
from pyxel.models.charge_generation import simple_conversion
from pyxel.models.charge_measurement import output_node_noise, simple_measurement
from pyxel.models.photon_collection import shot_noise
from pyxel.models.photon_collection.point_spread_function import apply_psf_2d
from pyxel.models.readout_electronics import simple_adc

VOLTS = 1e-6  # an electron's


def prepared_detector(detector, per_radiance, kernel):
    """What makes counts of the radiance of elements, by a detector as chipglow describes it."""
    efficiency = detector.response.quantum_efficiency
    noise = VOLTS * next(
        term.standard_deviation for term in detector.terms if term.kind == "read-noise"
    )

    def digitise(radiance):
        rows, columns = radiance.shape
        device = CMOS(
            geometry=CMOSGeometry(row=rows, col=columns),
            environment=Environment(),
            characteristics=Characteristics(
                quantum_efficiency=efficiency,
                adc_bit_resolution=detector.bits,
                adc_voltage_range=(0.0, VOLTS * detector.full_well),
            ),
        )
        device.set_readout(times=[10e-6])
        photons = apply_psf_2d(radiance * (per_radiance / efficiency), kernel)
        device.photon.array = photons.clip(min=0.0)  # The transform leaves some under 0.
        shot_noise(device)
        simple_conversion(device)
        simple_collection(device)
        simple_measurement(device, gain=VOLTS)
        output_node_noise(device, std_deviation=noise)
        simple_adc(device)
        return device.image.array

    return digitise
