"""The point spread function of a camera, from images of a knife edge."""

from chipglow.laboratory.psf.edge_image import (
    EdgeImage as EdgeImage,
    counts_image as counts_image,
    edge_image as edge_image,
)
from chipglow.laboratory.psf.edge_line import (
    EdgeLine as EdgeLine,
    NoEdgeError as NoEdgeError,
    find_edge as find_edge,
)
from chipglow.laboratory.psf.file import (
    load_apertures as load_apertures,
    load_edge as load_edge,
    write_psf as write_psf,
)
from chipglow.laboratory.psf.knife_edge import (
    EdgeResult as EdgeResult,
    KnifeEdge as KnifeEdge,
    knife_edge as knife_edge,
    psf_kernel as psf_kernel,
)
from chipglow.laboratory.psf.psf_fit import ModelFit as ModelFit
from chipglow.laboratory.psf.size_of_source import (
    ApertureImage as ApertureImage,
    aperture_image as aperture_image,
)
