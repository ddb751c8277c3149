"""Words that every report explains."""

from typing import Final

from chipglow.report.page import Term

INTERVAL: Final = Term(
    "interval",
    "95 % interval",
    "Where one more draw, with other values of all causes, lies with 95 % probability: a "
    "prediction interval about the mean with the degrees of freedom of Welch and Satterthwaite "
    "(JCGM 100, G.4). Few values of a cause, such as two segments, widen it.",
)
PSF: Final = Term(
    "psf",
    "PSF's portion",
    "The error less that of the same camera without point spread function (PSF), in the same draw.",
)
