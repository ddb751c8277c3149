"""Draws the picture of the page on a hot band: ``python docs/pictures/hot_band.py``.

It prints the page's numbers, of the study and the command that the page shows.
"""

import re
from pathlib import Path
from tempfile import TemporaryDirectory

from chipglow.study import band_reading, load_study

HERE = Path(__file__).parent


def main() -> None:
    """Read the band with the camera of the page, and draw it."""
    page = (HERE.parent / "do" / "hot-band.md").read_text(encoding="utf-8")
    found = re.search("```yaml\n(.*?)```", page, re.DOTALL)
    assert found
    with TemporaryDirectory() as folder:
        path = Path(folder, "camera.yaml")
        path.write_text(found[1], encoding="utf-8")
        reading = band_reading(load_study(path), 20e-6, 300.0, 4.0)
    print(reading.to_frame().to_string())
    reading.plot().savefig(HERE / "hot-band.png", dpi=150)


if __name__ == "__main__":
    main()
