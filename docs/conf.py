"""How the documentation is built: ``sphinx-build -W -b html docs FOLDER``."""

import sys
from importlib.metadata import version as installed_version
from pathlib import Path

HERE = Path(__file__).parent
GENERATED = HERE / "generated"
sys.path.insert(0, str(HERE))  # for mathml, field_tables and sample_files

from example_figures import use_panels  # noqa: E402
from field_tables import field_tables  # noqa: E402
from sample_files import SAMPLES, write_archive  # noqa: E402

from chipglow.io import ImportDescription  # noqa: E402
from chipglow.laboratory.recordings import MeasurementDescription  # noqa: E402
from chipglow.study import Study, study_text  # noqa: E402

project = "chipglow"
author = "The chipglow developers"
copyright = "The chipglow developers, Apache-2.0"
release = version = installed_version("chipglow")

extensions = [
    "mathml",
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_gallery.gen_gallery",
]
templates_path = ["_templates"]
exclude_patterns = [
    "generated/*.yaml",
    "generated/fields.md",
    "generated/import-fields.md",
    "generated/measurement-fields.md",
    "verification/*",
]
default_role = "py:obj"

sphinx_gallery_conf = {
    "examples_dirs": "../examples/gallery",
    "gallery_dirs": "gallery",
    "filename_pattern": "",
    "abort_on_example_error": True,
    "image_scrapers": ("example_figures.take",),
    "subsection_order": [
        "../examples/gallery/effects",
        "../examples/gallery/laboratory",
        "../examples/gallery/fields",
    ],
    "within_subsection_order": "example_figures.Order",
    "remove_config_comments": True,
    "show_memory": False,
    "write_computation_times": False,
    "show_signature": False,
    "download_all_examples": False,
}

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "none"
autosummary_generate = True
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

html_theme = "pydata_sphinx_theme"
html_title = "chipglow"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_sidebars = {
    "generated/**": ["api-page"],
    **{pages: ["all-pages"] for pages in ("*", "gallery/**", "[dlu]*/**")},
}
html_theme_options = {
    "show_toc_level": 2,
    "navigation_with_keys": False,
    "navbar_center": [],
    "secondary_sidebar_items": ["page-toc"],
}

# The page on files shows the paper's study as the program itself writes it.
GENERATED.mkdir(exist_ok=True)
(GENERATED / "study.yaml").write_text(study_text(Study()), encoding="utf-8")

# The page on studies shows the schema's description of every field.
SECTIONS = [
    field_tables(getattr(Study(), name), name) for name in ("cutting", "camera", "analysis")
]
(GENERATED / "fields.md").write_text("\n".join(SECTIONS), encoding="utf-8")

# So does the page on imports.
(GENERATED / "import-fields.md").write_text(
    field_tables(ImportDescription(), "import"), encoding="utf-8"
)

# And the page on measurements.
(GENERATED / "measurement-fields.md").write_text(
    field_tables(MeasurementDescription(), "measurement"), encoding="utf-8"
)

# Pages offer the files with which their commands can be tried.
for page in SAMPLES:
    write_archive(page, GENERATED / f"{page}.zip")


PLAIN: dict[str, list[str]] = {}


def keep_plain(app, what, name, obj, options, lines):
    """Keep the docstring of an attribute: Napoleon takes what is before a colon for its type."""
    if what in ("attribute", "data", "property"):
        PLAIN[name] = list(lines)


def restore_plain(app, what, name, obj, options, lines):
    """Restore the docstring of an attribute after Napoleon."""
    lines[:] = PLAIN.pop(name, lines)


def setup(app):
    """Surround Napoleon, whose priority is 500, and follow the gallery, which has the same."""
    app.connect("builder-inited", use_panels, priority=600)
    app.connect("autodoc-process-docstring", keep_plain, priority=400)
    app.connect("autodoc-process-docstring", restore_plain, priority=600)
