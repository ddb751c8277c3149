"""The section of the camera's detector."""

from typing import Annotated

from pydantic import Strict

from chipglow.camera import DETECTOR_TERMS, RESPONSES, Detector, DetectorResponse, DetectorTerm
from chipglow.quantities import Declared, described
from chipglow.quantities.part import parameters

ResponseSection = Annotated[Declared[DetectorResponse], RESPONSES]
DetectorTermSection = Annotated[Declared[DetectorTerm], DETECTOR_TERMS]


class DetectorSection(Declared[Detector]):
    """The detector: electrons of light, what happens to them, counts, calibration."""

    response: ResponseSection = described(
        ..., f"Electrons that light makes. Kinds:\n{RESPONSES.examples}"
    )
    terms: Annotated[tuple[DetectorTermSection, ...], Strict(False)] = described(
        [],
        "What happens besides, a list; each acts in its own place between light and counts.\n"
        f"Kinds:\n{DETECTOR_TERMS.examples}",
    )

    def build(self) -> Detector:
        """The detector."""
        return Detector(
            response=self.response.build(),
            terms=tuple(term.build() for term in self.terms),
            **{name: getattr(self, name) for name in parameters(Detector)},
        )
