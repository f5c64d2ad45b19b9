"""`python -m oio.bench filters`: run time per filter step (prediction and update) in microseconds, against filterpy."""

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

from rich.markup import escape

from oio.bench.arguments import Arguments, read
from oio.bench.filter_workload import Workload, filterpy_alone, first_belief, matrices, model_alone, workload
from oio.bench.output_folder import claim_folder
from oio.bench.trial import composed_trial
from oio.cli import terminal
from oio.cli.csv_file import names, write
from oio.cli.help import choices
from oio.cli.table_layout import print_table
from oio.core.errors import BadInput
from oio.core.folders import CONF
from oio.estimators.base import Estimator

TABLE = "filters.csv"
HEADS = ("filter", "step [us]", "filterpy's algebra [us]", "ratio", "filterpy with the model [us]", "ratio")


@dataclass(frozen=True)
class Row:
    """Microseconds per step. filterpy's algebra has precomputed matrices; with the model, as in use, they are evaluated once a step."""

    ekf: str
    step_us: float
    filterpy_us: float
    ratio: float
    filterpy_with_model_us: float
    ratio_with_model: float


def run(arguments: list[str]) -> None:
    """Run the command: timing and table."""
    words = read("filters", arguments)
    chosen = [name for name, _ in choices(CONF, "ekf")] if words.own["ekf"] == "null" else list(words.several("ekf"))
    steps, repeats, dof = words.whole("steps", 1), words.whole("repeats", 1), words.own["dof"]
    if dof not in ("3", "5"):
        raise BadInput(f"dof={dof} was given, but the course of the filters takes three or five joints. Type e.g. dof=5.")
    estimators = {name: _estimator(words, name) for name in chosen}
    out = claim_folder(words.own["out"], "filters", (TABLE,))
    found = timed(estimators, workload(composed_trial(_words(words, chosen[0]))[1], steps), repeats)
    write(out / TABLE, names(Row), map(asdict, found))
    show(found, str(out))


def timed(estimators: dict[str, Estimator], way: Workload, repeats: int) -> list[Row]:
    """Time all filters on one workload, in one process."""
    ready = matrices(way)
    filterpy_us = _fastest(lambda: filterpy_alone(way, ready), repeats, way)
    model_us = _fastest(lambda: model_alone(way, ready), repeats, way)
    return [_row(name, _fastest(_steps(ekf, way), repeats, way), filterpy_us, model_us) for name, ekf in estimators.items()]


def _row(name: str, step_us: float, filterpy_us: float, model_us: float) -> Row:
    both_us = filterpy_us + model_us
    return Row(name, step_us, filterpy_us, step_us / filterpy_us, both_us, step_us / both_us)


def _steps(ekf: Estimator, way: Workload) -> Callable[[], None]:
    def all_of_them() -> None:
        belief = first_belief(ekf, way)
        for joints, reading in zip(way.joints, way.readings, strict=True):
            belief = ekf.predict(way.model, belief, joints)
            belief, _ = ekf.update(way.model, belief, reading)

    return all_of_them


def _fastest(work: Callable[[], None], repeats: int, way: Workload) -> float:
    """Microseconds per step of the fastest of `repeats` passes, after one pass for compilation."""
    work()
    spent_s = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        spent_s.append(time.perf_counter() - began)
    return 1e6 * min(spent_s) / len(way.joints)


def _words(words: Arguments, ekf: str) -> tuple[str, ...]:
    return f"sensor={words.own['sensor']}", f"dof={words.own['dof']}", f"ekf={ekf}", *words.overrides


def _estimator(words: Arguments, name: str) -> Estimator:
    found = getattr(composed_trial(_words(words, name))[1].stages.get("navigate"), "ekf", None)
    if not isinstance(found, Estimator):
        raise BadInput("stage= was given without 'navigate', whose filter is measured. Leave stage= out.")
    return found


def show(found: list[Row], where: str) -> None:
    """Print the table."""
    rows = [
        [
            r.ekf,
            f"{r.step_us:.0f}",
            f"{r.filterpy_us:.0f}",
            f"{r.ratio:.2f}",
            f"{r.filterpy_with_model_us:.0f}",
            f"{r.ratio_with_model:.2f}",
        ]
        for r in found
    ]
    print_table(terminal.console(), "one step: a prediction and an update", HEADS, rows)
    console = terminal.console(soft_wrap=True)
    console.print(f"the table is in {escape(where)}")
