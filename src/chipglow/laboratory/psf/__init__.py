"""The point spread function of a camera, from images of a knife edge."""

from chipglow.laboratory.psf.edge_image import EdgeImage, counts_image, edge_image
from chipglow.laboratory.psf.edge_line import EdgeLine, NoEdgeError, find_edge
from chipglow.laboratory.psf.file import load_apertures, load_edge, write_psf
from chipglow.laboratory.psf.kernel import psf_kernel
from chipglow.laboratory.psf.knife_edge import EdgeResult, KnifeEdge, knife_edge
from chipglow.laboratory.psf.psf_fit import ModelFit
from chipglow.laboratory.psf.radial_psf import RadialPSF
from chipglow.laboratory.psf.size_of_source import ApertureImage, aperture_image

__all__ = [
    "ApertureImage",
    "EdgeImage",
    "EdgeLine",
    "EdgeResult",
    "KnifeEdge",
    "ModelFit",
    "NoEdgeError",
    "RadialPSF",
    "aperture_image",
    "counts_image",
    "edge_image",
    "find_edge",
    "knife_edge",
    "load_apertures",
    "load_edge",
    "psf_kernel",
    "write_psf",
]
