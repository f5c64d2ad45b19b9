"""The map of the project holds: no import circle between modules or packages, few loose modules, a door in every package."""

import itertools
import re
import tomllib
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("oio", "pipelines", "hardware")
INITS = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("__init__.py"))
CONTRACTS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]


@pytest.fixture(scope="module")
def imports():
    """Of every module the modules that it imports, imports for type checking alone among them."""
    graph = grimp.build_graph(*PACKAGES, exclude_type_checking_imports=False, cache_dir=None)
    return {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}


def circle(edges):
    """Some circle of a graph {node: {nodes}}, as a list of nodes; empty if there is none."""
    done, path = set(), []

    def visit(node):
        if node in path:
            return [*path[path.index(node) :], node]
        if node in done:
            return []
        path.append(node)
        found = next(filter(None, (visit(other) for other in sorted(edges.get(node, ())))), [])
        path.pop()
        done.add(node)
        return found

    return next(filter(None, (visit(node) for node in sorted(edges))), [])


def test_a_circle_is_found():
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": set()}) == ["a", "b", "c", "a"]
    assert circle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_no_module_imports_itself_by_way_of_others(imports):
    assert circle(imports) == []


def room(module):
    """`oio.gas` of oio.gas.bouts; a module that lies directly in a top package is a room of its own."""
    return ".".join(module.split(".")[:2])


def test_no_room_imports_itself_by_way_of_others(imports):
    edges = {}
    for module, others in imports.items():
        edges.setdefault(room(module), set()).update(room(other) for other in others if room(other) != room(module))
    assert circle({key: value - set(PACKAGES) for key, value in edges.items() if key not in PACKAGES}) == []


@pytest.mark.parametrize(("package", "most"), [("oio", 8), ("hardware", 4)])
def test_few_modules_lie_loose(package, most):
    loose = [path.stem for path in (ROOT / package).glob("*.py") if path.stem != "__init__"]
    assert len(loose) <= most, loose


@pytest.mark.parametrize("init", INITS, ids=lambda path: str(path.parent.relative_to(ROOT)))
def test_every_package_says_what_is_inside_and_what_it_may_import(init):
    said = init.read_text(encoding="utf-8").split('"""')[1]
    if init.parent.name in PACKAGES and init.parent.name != "hardware":
        return
    assert re.search(r"^May import: .+\. May not import: .+", said, re.MULTILINE), init


def test_every_room_stands_in_a_contract_of_layers(imports):
    """So that a new room cannot be forgotten; the commands in `oio` itself are shims."""
    layers = [layer for contract in CONTRACTS if contract["type"] == "layers" for layer in contract["layers"]]
    named = set(itertools.chain.from_iterable(re.split(r"\s*[|:]\s*", layer) for layer in layers))
    rooms = {room(module) for module in imports if module.count(".") and not module.startswith("pipelines")}
    assert rooms - named <= {"oio.run", "oio.recover", "oio.protocol", "oio.__main__"}
