"""Reports without their figures."""

from PIL import Image

from chipglow.drawing import drawing


def leave_undrawn(monkeypatch):
    """Figures of a report are blank files: drawing them takes longer than all the rest."""

    def save(figure, folder, name):
        png, svg = folder / f"{name}.png", folder / f"{name}.svg"
        size = tuple(round(inches * 150) for inches in figure.get_size_inches())
        Image.new("1", size, 1).convert("RGB").save(png)
        svg.write_text('<svg xmlns="http://www.w3.org/2000/svg"/>', encoding="utf-8")
        return png, svg

    monkeypatch.setattr(drawing, "save", save)
