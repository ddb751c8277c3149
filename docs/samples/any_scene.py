"""Fields of the page on any scene, as other programs write them."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

AMBIENT: Final = 293.0

POWER, SPEED = 90.0, 0.8
"""Absorbed laser power in W and scanning speed in m/s, typical of laser powder-bed fusion."""

CONDUCTIVITY, DIFFUSIVITY = 30.0, 5.4e-6
"""Conductivity and diffusivity of hot stainless steel, in W/(m K) and m²/s."""

HOTTEST_POOL: Final = 3500.0


def melt_pool(folder: Path) -> None:
    """Write eight frames of a melt pool seen from above, as unstructured grids of VTK.

    Rosenthal's moving point source, ended where the metal boils.
    """
    import pyvista

    x, y = np.meshgrid(np.arange(-300.0, 101.0, 4.0), np.arange(-120.0, 121.0, 4.0))
    for number in range(8):
        ahead = 1e-6 * x - SPEED * 5e-6 * number
        distance = np.maximum(np.hypot(ahead, 1e-6 * y), 1e-6)
        source = POWER / (2 * np.pi * CONDUCTIVITY * distance)
        rise = source * np.exp(-SPEED * (distance + ahead) / (2 * DIFFUSIVITY))
        grid = pyvista.StructuredGrid(x, y, np.zeros_like(x)).cast_to_unstructured_grid()
        temperature = np.minimum(AMBIENT + rise, HOTTEST_POOL)
        grid["temperature"] = temperature.ravel(order="F").astype(np.float32)
        grid.save(folder / f"pool_{number}.vtu")


def kolsky_bar(folder: Path) -> None:
    """Write an adiabatic shear band of a torsional Kolsky bar: temperature alone, as arrays.

    A band that narrows from 200 um to 30 um while it heats by 500 K, about as Marchand and Duffy
    (1988) found it in HY-100 steel.
    """
    time = np.arange(0.0, 40e-6, 1e-6)
    y = 1e-6 * np.arange(-150.0, 150.0, 2.0)
    fraction = time / time[-1]
    width = (200.0 - 170.0 * fraction) * 1e-6
    rise = 60.0 + 500.0 * fraction**3
    across = np.exp(-4 * np.log(2) * (y / width[:, None]) ** 2)
    temperature = AMBIENT + 60.0 * fraction[:, None] + (rise[:, None] - 60.0) * across
    field = np.repeat(temperature[:, :, None], 100, axis=2).astype(np.float32)
    np.savez_compressed(folder / "bar.npz", temperature=field)


def brake_disc(folder: Path) -> None:
    """Write a movie of a brake disc with hot spots and a colour scale, as a program exports it."""
    import av

    with av.open(str(folder / "disc.avi"), "w") as movie:
        stream: Any = movie.add_stream("ffv1", rate=20)
        stream.width, stream.height, stream.pix_fmt = 400, 320, "bgr0"
        for number in range(4):
            frame = av.VideoFrame.from_ndarray(_disc_picture(number), format="rgb24")
            for packet in stream.encode(frame.reformat(format="bgr0")):
                movie.mux(packet)
        for packet in stream.encode():
            movie.mux(packet)


DISC: Final = (80.0, 600.0)
"""Temperatures in °C at the ends of the disc's scale."""


def _disc_picture(number: int) -> NDArray[np.uint8]:
    """One picture: the disc, and its legend of the map jet on the right."""
    import matplotlib

    row, column = np.mgrid[:320, :400].astype(float)
    across, down = column - 160.0, row - 160.0
    radius, angle = np.hypot(across, down), np.arctan2(down, across)
    spots = np.maximum(np.cos(3 * (angle - 0.15 * number)), 0.0) ** 4
    ring = np.exp(-(((radius - 110.0) / 22.0) ** 2))
    celsius = 120.0 + ring * (180.0 + 260.0 * spots)
    fraction = (celsius - DISC[0]) / (DISC[1] - DISC[0])
    jet = matplotlib.colormaps["jet"]
    picture = np.full((320, 400, 3), 255, np.uint8)
    disc = (radius > 70) & (radius < 150)
    picture[disc] = jet(fraction, bytes=True)[disc][:, :3]
    legend = jet(np.linspace(1, 0, 240), bytes=True)[:, None, :3]
    picture[39:281, 349:371] = 0
    picture[40:280, 350:370] = legend
    return picture


def samples(folder: Path) -> None:
    """Write the fields of all three examples."""
    melt_pool(folder)
    kolsky_bar(folder)
    brake_disc(folder)
