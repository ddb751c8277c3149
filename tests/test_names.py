"""The names of the package itself: those that its pages use, and no others."""

import re

import pytest
from documented import PAGES

import chipglow

CODE = re.compile(r"```python\n(.*?)```", re.DOTALL)


@pytest.mark.parametrize("name", chipglow.__all__)
def test_every_name_is_there(name):
    assert getattr(chipglow, name) is not None


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_a_page_uses_is_in_the_package_itself(page):
    code = "\n".join(CODE.findall(page.read_text(encoding="utf-8")))
    assert re.findall(r"(?:from|import) +chipglow\.[\w.]+", code) == []
    used = re.findall(r"from chipglow import ([^\n]+)", code)
    names = {name.strip() for line in used for name in line.split(",")}
    names |= set(re.findall(r"\bchipglow\.(\w+)", code))
    assert names <= set(chipglow.__all__)


def test_the_rooms_are_found_by_name():
    rooms = {"analysis", "camera", "chip", "correction", "cutting", "io", "laboratory", "study"}
    assert rooms < set(dir(chipglow))
    assert {"sweep", "design", "study_budget"} < set(dir(chipglow))


def test_the_reference_begins_with_ten_names():
    reference = next(page for page in PAGES if page.name == "api.md").read_text(encoding="utf-8")
    begin, _, _ = reference.partition("\n## ")
    names = re.findall(r"^\| \{py:\w+\}`chipglow\.(\w+) <", begin, re.MULTILINE)
    assert len(set(names)) == 10
    assert set(names) <= set(chipglow.__all__)
