"""The documentation: its blocks of code run as a reader types them, and its pages are whole."""

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from html.parser import HTMLParser
from pathlib import Path
from posixpath import join, normpath
from urllib.parse import unquote, urlsplit

import matplotlib
import pytest
from documented import PAGES, PARTS, ROOT, Reader, blocks
from matplotlib import pyplot as plt

sys.path.append(str(ROOT / "docs"))
LANGUAGES = {"python", "console", "yaml", "text", "matlab"}
DIRECTIVES = re.compile(r"\{(eval-rst|include|literalinclude|toctree)\}.*")
WITH_CODE = [page for page in PAGES if any(one.language in LANGUAGES for one in blocks(page))]
MOST_NOT_RUN = 15


def page_id(page):
    return page.name


@pytest.fixture
def reader(tmp_path, quick_study, own_laws, read_here, undrawn, few_draws, monkeypatch):
    """A reader who has run the quick study."""
    cache, folder = tmp_path / "cache", tmp_path / "work"
    cache.mkdir()
    shutil.copytree(quick_study.results, folder / "chipglow-paper")
    known = {scene.name for scene in quick_study.cache.glob("scene-*.nc")}
    for name in known:
        os.link(quick_study.cache / name, cache / name)
    monkeypatch.setenv("CHIPGLOW_CACHE", str(cache))
    # A correction takes longer than the rest of a small study; that of the quick study is tested.
    monkeypatch.setattr("chipglow.analysis.engine.corrected_windows", lambda *_: ())
    monkeypatch.setattr(plt, "show", lambda: None)
    matplotlib.use("Agg")
    yield Reader(folder, done=("chipglow reproduce --quick",))
    plt.close("all")
    assert {scene.name for scene in cache.iterdir()} == known, "a page makes its reader wait"


@pytest.mark.slow
@pytest.mark.parametrize("page", WITH_CODE, ids=page_id)
def test_the_blocks_of_a_page_run(page, reader):
    from sample_files import SAMPLES, write_samples

    if page.stem in SAMPLES:
        write_samples(page.stem, reader.folder)
    for block in blocks(page):
        reader.follow(block)


def test_pages_install_extras_by_the_command_of_the_messages():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    for page in (*PAGES, ROOT / "CONTRIBUTING.md"):
        for line in page.read_text("utf-8").splitlines():
            if "pip install" in line:
                (extras,) = re.findall(r'python -m pip install (?:-e )?"\.\[([a-z,]+)\]"', line)
                assert set(extras.split(",")) <= set(project["optional-dependencies"]), page


def test_the_readmes_python_prints_what_is_shown(tmp_path, capsys):
    _install, _table, python, printed, *_ = blocks(ROOT / "README.md")
    Reader(tmp_path).follow(python)
    assert capsys.readouterr().out == printed.text


@pytest.mark.slow
def test_the_readme_shows_the_rows_of_the_quick_study(quick_study):
    """Their numbers depend on the processor."""
    _install, table, *_ = blocks(ROOT / "README.md")
    for row in table.text.splitlines():
        assert row.strip().split("  ")[0] in quick_study.printed


def test_few_blocks_are_not_run_and_each_says_why():
    left = [block for page in PAGES for block in blocks(page) if block.note == "not run"]
    assert all(len(block.about.split()) > 1 for block in left)
    assert len(left) <= MOST_NOT_RUN, "\n".join(f"{block}: {block.about}" for block in left)


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_a_block_says_what_it_is(page):
    found = blocks(page)
    for number, block in enumerate(found):
        assert block.language in LANGUAGES or DIRECTIVES.fullmatch(block.language), str(block)
        assert block.language != "yaml" or block.note, f"{block}: a file, or which kind?"
        if block.note == "file":
            assert block.about in block.words, f"{block}: the reader is not told the name"
            assert any(block.about in later.text for later in found[number + 1 :]), str(block)
    indented = re.compile(r"\n\n {4}(chipglow|python|pip) ")
    assert not indented.search(page.read_text(encoding="utf-8"))


OUTSIDE = {"https", "http", "mailto"}


class Page(HTMLParser):
    """What a page of HTML loads and is linked to, where its column of pages leads, its words."""

    def __init__(self, name):
        super().__init__()
        self.name = name
        self.loaded, self.links, self.column, self.ids, self.words = [], [], set(), set(), ""
        self._in_column = False

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        if identity := values.get("id"):
            self.ids.add(identity)
        if tag == "link" and values.get("rel") == "stylesheet":
            self.loaded.append(values["href"])
        elif tag != "a" and "src" in values:
            self.loaded.append(values["src"])
        elif tag == "nav":
            self._in_column = values.get("aria-label") == "Pages"
        elif tag == "a" and "href" in values:
            self.links.append(values["href"])
            if self._in_column:
                self.column.add(self.target(values["href"])[0])

    def target(self, link):
        """The file in the site that a link leads to, and the place in it."""
        parts = urlsplit(link)
        path = normpath(join(self.name, "..", unquote(parts.path))) if parts.path else self.name
        return path, unquote(parts.fragment)

    def handle_endtag(self, tag):
        self._in_column = self._in_column and tag != "nav"

    def handle_data(self, data):
        self.words += data


# The gallery's readers run in Sphinx's process: it opens about 30 files, each process takes 1 s.
BUILD = """
import sys
from conftest import run_readers_here
from sphinx.cmd.build import main
run_readers_here()
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="session")
def site(shared_folder):
    """The folder of the pages, built with warnings as errors."""
    pytest.importorskip("sphinx_gallery", reason="needs the extra docs")
    return shared_folder("site", build)


def build(folder):
    """Build the pages from stubs that are made anew."""
    for stub in (ROOT / "docs" / "generated").glob("*.rst"):
        stub.unlink()
    command = [sys.executable, "-c", BUILD, "-q", "-W", str(ROOT / "docs"), str(folder)]
    run = subprocess.run(
        command,
        cwd=Path(__file__).parent,
        env={**os.environ, "NUMBA_NUM_THREADS": "1"},
        capture_output=True,
        encoding="utf-8",
    )
    assert run.returncode == 0, run.stderr


@pytest.fixture(scope="module")
def built(site):
    """The pages by their names."""
    pages = {}
    for path in site.rglob("*.html"):
        page = Page(path.relative_to(site).as_posix())
        page.feed(path.read_text(encoding="utf-8"))
        pages[page.name] = page
    return pages


def html_name(page):
    return page.relative_to(ROOT / "docs").with_suffix(".html").as_posix()


@pytest.mark.slow
def test_every_page_leads_to_all_others(built):
    names = {html_name(page) for page in PAGES if page.name != "README.md"}
    assert len({name.split("/")[0] for name in names} & set(PARTS)) == len(PARTS)
    for name in names | {"gallery/index.html"}:
        assert names - {"index.html"} <= built[name].column, name


@pytest.mark.slow
def test_links_lead_somewhere(built, site):
    """Those within the site to a place in it; nobody asks the network for the others."""
    for page in built.values():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme:
                assert parts.scheme in OUTSIDE, f"{page.name}: {link}"
                assert parts.scheme == "mailto" or "." in parts.netloc, f"{page.name}: {link}"
                assert not re.search(r"[\s<>]", link), f"{page.name}: {link}"
                continue
            path, place = page.target(link)
            assert (site / path).exists(), f"{page.name}: {link}"
            assert not place or place in built[path].ids, f"{page.name}: {link}"


def test_the_readmes_links_lead_to_files():
    for name in ("README.md", "CONTRIBUTING.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        for link in re.findall(r"\]\((?!https?:)([^)#]+)", text):
            assert (ROOT / link).exists(), f"{name}: {link}"


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page.parent.name in PARTS[:3]], ids=page_id
)
def test_a_page_begins_with_what_you_get_and_a_picture(page):
    _, first, then = page.read_text(encoding="utf-8").split("\n\n")[:3]
    assert first.startswith("What you get")
    assert then.startswith("![")


def test_examples_say_what_is_seen():
    examples = [*(ROOT / "examples" / "gallery").glob("*/*.py")]
    assert len(examples) > 20
    for example in examples:
        text = example.read_text(encoding="utf-8")
        assert "What you see" in text, example
        assert f"sphx_glr_{example.stem}_001.png" in text.partition("\n\n")[2][:120], example


@pytest.mark.slow
def test_pages_need_no_network(built):
    assert not [source for page in built.values() for source in page.loaded if "//" in source]


@pytest.mark.slow
def test_the_search_needs_no_server(site):
    index = (site / "searchindex.js").read_text(encoding="utf-8")
    assert index.startswith("Search.setIndex(")
    assert "learn/tutorial" in index


ANSWERED = {
    "true temperature": "do/correct",
    "batch": "do/many-files",
    "excel": "do/in-excel",
    "matlab": "do/in-matlab",
}


@pytest.mark.slow
@pytest.mark.parametrize("words", ANSWERED)
def test_the_search_lists_first_the_page_that_answers(words, site):
    """A main entry of the index that equals the query scores 100, a title at most 16, a word 5."""
    script = (site / "searchindex.js").read_text(encoding="utf-8")
    index = json.loads(script.removeprefix("Search.setIndex(").removesuffix(")"))
    ((page, _, is_main),) = index["indexentries"][words]
    assert is_main
    assert index["docnames"][page] == ANSWERED[words]


@pytest.mark.slow
def test_equations_are_drawn_by_the_browser(built):
    shown = built["understand/physics.html"].words
    assert "∫" in shown
    for name, page in built.items():
        if not name.startswith(("gallery/", "_modules/")):
            assert not re.search(r"\\\(|\\\[|\\[a-z]+\{", page.words), name
