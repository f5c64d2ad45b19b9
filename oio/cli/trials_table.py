"""The table of several trials of one job in the terminal."""

from collections.abc import Mapping
from typing import Any

from oio.cli import terminal
from oio.cli.console import OUTCOMES, number
from oio.cli.hanging_text import print_hanging
from oio.cli.table_layout import print_table
from oio.results.criteria.judgement import PASS, WORDS


def show_trials(document: Mapping[str, Any], where: str) -> None:
    """Print the distribution of every outcome, the verdicts, and which criteria warned or failed how often."""
    told, console = document["distribution"], terminal.console(soft_wrap=True)
    last = told["first_seed"] + told["trials"] - 1
    failed = f", {len(told['failed'])} failed" if told["failed"] else ""
    title = (
        f"{document['sensor']} ({document['profile']}), dof={document['dof']}, air={document['air']}, "
        f"{told['trials']} trials{failed}, seeds {told['first_seed']} to {last}; brackets are 95 % intervals"
    )
    bearing = any("bearing_error_deg" in outcome for outcome in told["outcomes"].values())
    unit = "bearing error [deg]" if bearing else "source error [mm]"
    heads = ["", f"{unit}\nmedian", "90 %", "95 %", "worst", "in 95 % region [%]", "ANEES", "declared [%]"]
    print_table(console, title, heads, [_cells(OUTCOMES[key], outcome) for key, outcome in told["outcomes"].items()])
    verdicts = ", ".join(f"{word} {told['verdicts'][word]}" for word in WORDS if word in told["verdicts"])
    scored = ", ".join(f"{word} {count}" for word, count in told["scored"].items())
    print_hanging(console, "verdicts ", f"{verdicts}; scored against the truth: {scored}; PASS but wrong: {told['pass_but_wrong']}")
    doubted = {name: counts for name, counts in told["criteria"].items() if set(counts) != {PASS}}
    for name, counts in sorted(doubted.items(), key=lambda item: item[1].get(PASS, 0)):
        print_hanging(console, "  - ", f"{name}: {', '.join(f'{word} {counts[word]}' for word in WORDS if word in counts)}")
    for seed, reason in told["failed"].items():
        print_hanging(console, f"seed {seed} failed: ", reason)
    console.print(where, markup=False)


def _cells(name: str, outcome: Mapping[str, Any]) -> list[str]:
    position = "source_error_m" in outcome
    errors, factor = outcome["source_error_m" if position else "bearing_error_deg"] or {}, 1e3 if position else 1.0
    anees = outcome["anees"]
    consistency = "-" if anees is None else f"{anees['value']:.2f} [{anees['low']:.2f}-{anees['high']:.2f}]"
    quantiles = [number(errors.get(key), factor) for key in ("median", "p90", "p95", "worst")]
    return [name, *quantiles, _percent(outcome["in_95"]), consistency, _percent(outcome["declared"])]


def _percent(share: Mapping[str, float] | None) -> str:
    return "-" if share is None else f"{100 * share['share']:.0f} [{100 * share['low']:.0f}-{100 * share['high']:.0f}]"
