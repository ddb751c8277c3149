"""What is damaged, and how the product reads it."""

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from itertools import islice
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from seeds import source_of, write_seeds

from chipglow.cutting import workpiece
from chipglow.io import import_description, import_text, open_scene, write_scene
from chipglow.io.cameras import read_recording
from chipglow.io.sandbox import Isolated, Sandbox
from chipglow.laboratory.recordings import MeasurementDescription, measurement_text
from chipglow.laboratory.registration import Registration, load_registration, write_registration
from chipglow.scene import Raster, Scene
from chipglow.study import Study, load_study, study_text
from chipglow.text import Notes, load_described

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
import camera_files

LATE = 20.0
"""Seconds after which a reader is ended, where the product waits for 600 s."""

RASTER = Raster(0.0, 1.0, 1.0 / 24, 24, 24)

SNIPPETS = (
    b"&a [*a]", b"&a {<<: *a}", b"{a: &b [x, x], c: [*b, *b]}", b"<<: {}", b"!!int \"\"",
    b"!!float x", b"!!timestamp x", b"!!binary AAAA", b"!!python/name:os.system ", b"? [a]\n: b",
    b"9" * 400, b"1e999 m", b".nan", b"-.inf um", b"[" * 100, b"{" * 100, b"- " * 60,
    b"\"\\uD800\"", b"\0", b"1e-320 um", b"0x" + b"f" * 300, b"none", b"~", b"[]", b"{}",
    b"2026-13-45", b"%YAML 9.9\n",
)  # fmt: skip
"""Parts of YAML that are hostile, or of another type than a setting."""

MESSAGES = (
    {"n": 1, "kind": "change", "content": {"texts": {"cursor": "-40,200"}, "final": True}},
    {"n": 2, "kind": "change", "content": {"texts": {"camera.pitch": "5 um"}, "final": False}},
    {"n": 3, "kind": "step", "content": ""},
    {"n": 4, "kind": "save", "content": "study.yaml"},
    {"n": 5, "kind": "painted", "content": 1},
    {"n": 6, "kind": "theme", "content": "dark"},
    {"n": 7, "kind": "draw", "content": ""},
)


@dataclass(frozen=True)
class Target:
    """A damaged file: how it is read in a fork, and how the product reads it."""

    alone: Callable[[], Any]
    product: Callable[[], Any]


def write_targets(folder):
    """Write all files; the names of those to damage, relative to the folder."""
    names = write_seeds(folder)
    (folder / "study.yaml").write_text(study_text(Study()), "utf-8")
    (folder / "import.yaml").write_text(import_text(import_description()()), "utf-8")
    (folder / "measurement.yaml").write_text(measurement_text(MeasurementDescription()), "utf-8")
    materials = Path(sys.modules["chipglow.cutting"].__file__).parent / "materials" / "workpieces"
    (folder / "material.yaml").write_bytes((materials / "aisi-1045.yaml").read_bytes())
    registration = Registration(np.eye(3), 1e-6 * np.eye(9), "affine", "points", 5.0, Notes())
    write_registration(registration, folder / "map.yaml")
    times, raster = 1e-6 * np.arange(3), Raster(-4e-6, 4e-6, 1e-6, 8, 8)
    fields = {"temperature": np.full((3, *raster.shape), 700.0)}
    write_scene(Scene.from_fields(raster, times, fields), folder / "own.scene")
    for name, content in cameras().items():
        (folder / name).write_bytes(content)
    for number, message in enumerate(MESSAGES):
        (folder / f"{number}.message").write_text(json.dumps(message))
    return [*names, *OWN, *cameras(), *(f"{number}.message" for number in range(len(MESSAGES)))]


@cache
def cameras():
    images = camera_files.pictures()
    return {
        "frames.seq": camera_files.seq(images),
        "frame.jpg": camera_files.flir_jpeg(images[0]),
        "frames.ptw": camera_files.ptw(images),
        "frames.cine": camera_files.cine(images),
    }


OWN = {
    "study.yaml": load_study,
    "import.yaml": lambda path: load_described(import_description(), path),
    "measurement.yaml": partial(load_described, MeasurementDescription),
    "material.yaml": lambda path: workpiece(str(path)),
    "map.yaml": load_registration,
    "own.scene": lambda path: list(open_scene(path).frames()),
}


def target_of(folder, name):
    """The target of a file in a folder."""
    path = folder / name
    if name in OWN:
        return Target(partial(OWN[name], path), partial(OWN[name], path))
    if name.endswith(".message"):
        return Target(partial(send, path), partial(send, path))
    if name in cameras():
        read = partial(read_recording, path)
        return Target(read, read)
    source = source_of(folder, name)
    return Target(partial(sample, source), partial(sample, Isolated(source, Sandbox(name, LATE))))


def sample(source):
    source.survey()
    for _ in islice(source.frames(RASTER), 3):
        pass


@cache
def page():
    """The page of the app without a browser; what it would send there is left out."""
    from chipglow.app.opening import OpenFiles, open_any
    from chipglow.app.view import PageView

    opened = open_any(None)
    view = PageView(opened, files=OpenFiles(opened))
    view.page._send_msg = lambda content: None
    return view


def send(path):
    """Send a message to the page; text that is no JSON, which no browser sends, is a ValueError."""
    message = json.loads(path.read_bytes())
    page()._receive(SimpleNamespace(data=message))
