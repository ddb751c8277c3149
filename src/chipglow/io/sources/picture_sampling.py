"""From a picture's pixels to a raster: area means where it is coarser, bilinear where finer."""

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from chipglow.camera.optics.sampling import overlap_lengths
from chipglow.scene import Material, Raster

_HALF: Final = 0.5 - 1e-6


@dataclass(frozen=True)
class PictureSampling:
    """Sampling of fields with gaps.

    Parameters
    ----------
    pixels : Raster
        Where the pixels are.
    raster : Raster
        Where the samples shall be.
    """

    pixels: Raster
    raster: Raster

    def material(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Material that covers most of each sample; void beyond the picture.

        Parameters
        ----------
        pixels : ndarray
            `chipglow.scene.Material` of each pixel, shape `pixels.shape`, uint8.
        """
        workpiece = self._sum(pixels == Material.WORKPIECE)
        tool = self._sum(pixels == Material.TOOL)
        result = np.where(tool > workpiece, Material.TOOL, Material.WORKPIECE).astype(np.uint8)
        result[workpiece + tool < _HALF] = Material.VOID
        return result

    def mean(self, values: NDArray[np.float32], valid: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Mean of the valid pixels of each sample, float32; NaN where there is none."""
        fraction = self._sum(valid)
        total = self._sum(np.where(valid, values, 0.0))
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(fraction > 0, total / fraction, np.nan).astype(np.float32)

    def fraction(self, chosen: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Fraction of each sample that chosen pixels cover."""
        return self._sum(chosen)

    def _sum(self, pixels: NDArray[np.generic]) -> NDArray[np.float64]:
        down, across = self._weights
        return np.asarray((across @ (down @ pixels.astype(np.float64)).T).T)

    @cached_property
    def _weights(self) -> tuple[sparse.csr_array, sparse.csr_array]:
        pixels, raster = self.pixels, self.raster
        ratio = raster.spacing / pixels.spacing
        down = (pixels.top - raster.top) / pixels.spacing
        across = (raster.left - pixels.left) / pixels.spacing
        return (
            _line_weights(down, ratio, raster.rows, pixels.rows),
            _line_weights(across, ratio, raster.columns, pixels.columns),
        )


def _line_weights(begin: float, width: float, count: int, pixels: int) -> sparse.csr_array:
    """Weights of a line of pixels in a line of samples; lengths are in pixels."""
    left = begin + width * np.arange(count, dtype=np.float64)
    if width < 1:
        # A window of one pixel about a sample's middle gives the weights of linear interpolation.
        left, width = left + width / 2 - 0.5, 1.0
        inside = (left > -0.5 - 1e-9) & (left < pixels - 0.5 + 1e-9)
        left = np.where(inside, np.clip(left, 0, pixels - 1), left)
    return sparse.csr_array(overlap_lengths(left, width, pixels, 1.0) / width)
