"""The image of a surface in Pyxel 3, and its counts, for `camera_pass.py`.

The models of Pyxel one after the other, without its runner. Pyxel has no samples finer than its
elements: for an image the point spread function is laid on an array of samples, and the means over
the pixels are NumPy's; for counts it is laid on the elements.
"""

from pyxel.detectors import CMOS, Characteristics, CMOSGeometry, Environment
from pyxel.models.charge_collection import simple_collection
from pyxel.models.charge_generation import simple_conversion
from pyxel.models.charge_measurement import output_node_noise, simple_measurement
from pyxel.models.photon_collection import shot_noise
from pyxel.models.photon_collection.point_spread_function import apply_psf_2d
from pyxel.models.readout_electronics import simple_adc

VOLTS = 1e-6  # an electron's


def prepared(kernel, _fwhm, _spacing, group):
    """What forms an image: radiance of squares to that of `group` times larger ones."""

    def form(radiance):
        rows, columns = (count // group for count in radiance.shape)
        blurred = apply_psf_2d(radiance, kernel)
        return blurred.reshape(rows, group, columns, group).mean(axis=(1, 3))

    return form


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
