"""Draws docs/architecture.svg from the imports that the code really has: `python docs/architecture.py`; a test compares the two.

A box is a package, in the row of its import contract (pyproject.toml). An arrow is an import that does not follow from two others
(transitive reduction). Imports between `oio`, `pipelines` and `hardware` stand in the boxes as text.
"""

import ast
import sys
import tomllib
from html import escape
from pathlib import Path
from textwrap import wrap

import grimp

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "architecture.svg"
WIDTH, HEIGHT, GAP_X, GAP_Y, MARGIN = 216, 78, 34, 34, 16  # px
FILL = {"oio": "#e8f1fb", "hardware": "#fdf1e3", "pipelines": "#e9f6ec"}


def rows(title: str) -> list[list[str]]:
    """Packages by rows, the top first, of the `layers` contract whose name begins with `title`."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    (layers,) = (each["layers"] for each in contracts if each["type"] == "layers" and each["name"].startswith(title))
    return [[name.strip() for name in layer.split("|")] for layer in layers]


def package_imports() -> dict[str, set[str]]:
    """Packages that each package imports, from all modules."""
    graph = grimp.build_graph("oio", "pipelines", "hardware", cache_dir=None)
    found: dict[str, set[str]] = {}
    for module in graph.modules:
        own = found.setdefault(_package(module), set())
        own.update({_package(other) for other in graph.find_modules_directly_imported_by(module)} - {_package(module)})
    return found


def reduced(imports: dict[str, set[str]]) -> dict[str, set[str]]:
    """Imports that do not follow from two others."""
    return {
        name: {other for other in direct if not any(other in _reach(imports, via) for via in direct)} for name, direct in imports.items()
    }


def svg() -> str:
    """The picture."""
    arrows = reduced(package_imports())
    places = _places()
    width = max(x for x, _ in places.values()) + WIDTH + MARGIN + 40
    height = max(y for _, y in places.values()) + HEIGHT + MARGIN
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="11">',
        '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0 8 4 0 8z" fill="#555"/></marker></defs>',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
    ]
    for name, start in places.items():
        lines += [_arrow(start, places[other]) for other in sorted(arrows[name]) if other in places and _top(name) == _top(other)]
    for name in places:
        lines += _box(name, places[name], sorted(other for other in arrows[name] if _top(other) != _top(name)))
    return "\n".join([*lines, "</svg>\n"])


def _package(module: str) -> str:
    top, *rest = module.split(".")
    return top if top == "pipelines" or not rest else f"{top}.{rest[0]}"


def _top(name: str) -> str:
    return name.split(".")[0]


def _reach(imports: dict[str, set[str]], name: str) -> set[str]:
    found: set[str] = set()
    todo = [name]
    while todo:
        new = imports[todo.pop()] - found
        found |= new
        todo += sorted(new)
    return found


def _places() -> dict[str, tuple[int, int]]:
    """Upper left corner of each box [px]: `oio` in two columns, `hardware` in three to its right, `pipelines` above."""
    places = {"pipelines": (MARGIN + WIDTH + GAP_X, MARGIN)}
    oio, hardware = rows("oio"), rows("hardware")
    for left, layers in ((MARGIN, oio), (MARGIN + 2 * (WIDTH + GAP_X) + 40, [[]] * (len(oio) - len(hardware)) + hardware)):
        for row, layer in enumerate(layers):
            for column, name in enumerate(layer):
                places[name] = (left + column * (WIDTH + GAP_X), MARGIN + row * (HEIGHT + GAP_Y))
    return places


def _arrow(start: tuple[int, int], end: tuple[int, int]) -> str:
    """From the lower edge of one box to the upper edge of another; around the boxes in between where they are in one column."""
    if start[0] == end[0] and end[1] - start[1] > HEIGHT + GAP_Y:
        x, y0, y1, out = start[0] + WIDTH, start[1] + HEIGHT // 2, end[1] + HEIGHT // 2, 40
        path = f"M{x} {y0}C{x + out} {y0 + 30} {x + out} {y1 - 30} {x + 2} {y1}"
    else:
        side = (end[0] > start[0]) - (end[0] < start[0])
        x0, x1 = start[0] + WIDTH // 2 + side * WIDTH // 3, end[0] + WIDTH // 2 - side * WIDTH // 3
        path = f"M{x0} {start[1] + HEIGHT}L{x1} {end[1] - 2}"
    return f'<path d="{path}" fill="none" stroke="#555" marker-end="url(#head)"/>'


def _box(name: str, place: tuple[int, int], others: list[str]) -> list[str]:
    x, y = place
    text = _summary(name)
    lines = [
        f'<rect x="{x}" y="{y}" width="{WIDTH}" height="{HEIGHT}" rx="6" fill="{FILL[_top(name)]}" stroke="#777"/>',
        f'<text x="{x + 10}" y="{y + 18}" font-size="13" font-weight="bold">{name}</text>',
    ]
    for number, line in enumerate(wrap(text, 33)[:2]):
        lines.append(f'<text x="{x + 10}" y="{y + 34 + 14 * number}">{escape(line)}</text>')
    if others:
        lines.append(f'<text x="{x + 10}" y="{y + HEIGHT - 9}" fill="#666" font-style="italic">imports {", ".join(others)}</text>')
    return lines


def _summary(name: str) -> str:
    """What a package's docstring says before the first colon or full stop."""
    path = ROOT / name.replace(".", "/")
    source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    first = (ast.get_docstring(ast.parse(source.read_text(encoding="utf-8"))) or "").splitlines()[0]
    command, _, rest = first.partition("`: ")
    return (rest if command.startswith("`") and rest else first).split(":")[0].split(". ")[0].replace("`", "").rstrip(".")


if __name__ == "__main__":
    PICTURE.write_text(svg(), encoding="utf-8")
    sys.stdout.write(f"{PICTURE.relative_to(ROOT)}\n")
