"""The documentation: its blocks of code run as a reader types them, and its pages are whole."""

import os
import re
import subprocess
import sys
from html.parser import HTMLParser

import matplotlib
import pytest
from documented import PAGES, ROOT, Reader, blocks
from matplotlib import pyplot as plt

sys.path.append(str(ROOT / "docs"))
LANGUAGES = {"python", "console", "yaml", "text"}
DIRECTIVES = re.compile(r"\{(eval-rst|include|literalinclude|toctree)\}.*")
WITH_CODE = [page for page in PAGES if any(one.language in LANGUAGES for one in blocks(page))]
MOST_NOT_RUN = 8


def page_id(page):
    return page.name


@pytest.fixture
def reader(tmp_path, quick_study, own_laws, monkeypatch):
    """A reader whose cache holds the scene of the quick study."""
    cache, folder = tmp_path / "cache", tmp_path / "work"
    cache.mkdir()
    folder.mkdir()
    known = {scene.name for scene in quick_study.cache.glob("scene-*.nc")}
    for name in known:
        os.link(quick_study.cache / name, cache / name)
    monkeypatch.setenv("CHIPGLOW_CACHE", str(cache))
    monkeypatch.setattr(plt, "show", lambda: None)
    matplotlib.use("Agg")
    yield Reader(folder)
    plt.close("all")
    assert {scene.name for scene in cache.iterdir()} == known, "a page makes its reader wait"


@pytest.mark.parametrize("page", WITH_CODE, ids=page_id)
def test_the_blocks_of_a_page_run(page, reader):
    from sample_files import SAMPLES, write_samples

    if page.stem in SAMPLES:
        write_samples(page.stem, reader.folder)
    for block in blocks(page):
        reader.follow(block)


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


class Page(HTMLParser):
    """What a page of HTML loads, where its column of pages leads, and its words."""

    def __init__(self):
        super().__init__()
        self.loaded, self.column, self.words = [], set(), ""
        self._in_column = False

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        if tag == "link" and values.get("rel") == "stylesheet":
            self.loaded.append(values["href"])
        elif tag != "a" and "src" in values:
            self.loaded.append(values["src"])
        elif tag == "nav":
            self._in_column = values.get("aria-label") == "Pages"
        elif tag == "a" and self._in_column:
            self.column.add(values["href"].split("#")[0])

    def handle_endtag(self, tag):
        self._in_column = self._in_column and tag != "nav"

    def handle_data(self, data):
        self.words += data


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """The pages by name, built with warnings as errors from stubs that are made anew."""
    pytest.importorskip("sphinx", reason="sphinx is not installed: pip install '.[docs]'")
    for stub in (ROOT / "docs" / "generated").glob("*.rst"):
        stub.unlink()
    folder = tmp_path_factory.mktemp("html")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", str(ROOT / "docs"), str(folder)]
    done = subprocess.run(command, capture_output=True, encoding="utf-8")
    assert done.returncode == 0, done.stderr
    pages = {}
    for path in folder.glob("*.html"):
        pages[path.name] = Page()
        pages[path.name].feed(path.read_text(encoding="utf-8"))
    return pages


def test_every_page_leads_to_all_others(built):
    names = {f"{page.stem}.html" for page in PAGES if page.parent.name == "docs"}
    for name in names:
        assert names - {name, "index.html"} <= built[name].column, name


def test_pages_need_no_network(built):
    assert not [source for page in built.values() for source in page.loaded if "//" in source]


def test_equations_are_drawn_by_the_browser(built):
    shown = built["physics.html"].words
    assert "∫" in shown
    for name, page in built.items():
        assert not re.search(r"\\\(|\\\[|\\[a-z]+\{", page.words), name
