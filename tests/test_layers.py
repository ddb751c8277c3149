"""Imports inside the package: only downwards, and never round in a circle."""

import ast
import re
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src"


def module_name(path):
    parts = path.relative_to(SOURCE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def packages():
    """The packages in the order of CONTRIBUTING.md."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = text[text.index("| package | contents |") :].split("\n\n")[0]
    firsts = re.findall(r"^\| (`.*?) \|", table, re.MULTILINE)
    return [name for cell in firsts for name in re.findall(r"`(\w+)`", cell)]


def imported(nodes, module, is_package, known):
    """The modules of the package that nodes of a tree import, lazy ones and stubs included."""
    here = module if is_package else module.rpartition(".")[0]
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (one.name for one in node.names if one.name in known)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(filter(None, (here if node.level else "", node.module)))
            for one in node.names:
                found = [name for name in (f"{base}.{one.name}", base) if name in known]
                yield from found[:1]


def walked(tree, with_types):
    """The nodes of a tree, with or without what only type checkers see."""
    todo = [tree]
    while todo:
        node = todo.pop()
        tested = isinstance(node, ast.If) and getattr(node.test, "id", "")
        if with_types or tested != "TYPE_CHECKING":
            yield node
            todo.extend(ast.iter_child_nodes(node))


@cache
def parsed(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def graph(with_types):
    """What each module imports; the root is left out, as its names come from every package."""
    files = sorted(path for suffix in ("*.py", "*.pyi") for path in SOURCE.rglob(suffix))
    known = {module_name(path) for path in files}
    edges = {name: set() for name in known - {"chipglow", "chipglow.__main__"}}
    for path in files:
        module = module_name(path)
        if module in edges:
            nodes = walked(parsed(path), with_types)
            edges[module] |= set(imported(nodes, module, path.stem == "__init__", known))
    return edges


def test_every_package_is_in_the_list():
    own = [path for path in (SOURCE / "chipglow").iterdir() if path.name[0].isalpha()]
    names = {path.stem for path in own if path.is_dir() or path.suffix == ".py"}
    assert set(packages()) == names


def test_a_package_imports_only_from_packages_above_it():
    order = {name: number for number, name in enumerate(packages())}
    upwards = [
        (module, other)
        for module, others in graph(with_types=True).items()
        for other in others
        if other != "chipglow" and order[module.split(".")[1]] < order[other.split(".")[1]]
    ]
    assert upwards == []


def test_no_module_imports_itself_by_way_of_others():
    try:
        TopologicalSorter(graph(with_types=False)).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))
