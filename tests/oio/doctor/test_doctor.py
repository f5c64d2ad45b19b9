"""Every check of the doctor can pass, warn and fail; the report says the worst; the command's code is 3 only for a FAIL."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from hydra.utils import instantiate

from oio.core.folders import CONF
from oio.doctor import __main__ as command
from oio.doctor.clock import Clocks
from oio.doctor.finding import FAIL, PASS, WARN, Check, Finding
from oio.doctor.report import to_json, worst

ROOT = Path(__file__).resolve().parents[3]
NODES = yaml.safe_load((CONF / "doctor.yaml").read_text(encoding="utf-8"))
HERE = Path.cwd()


@pytest.fixture(scope="module")
def made():
    return {name: instantiate(node, _convert_="all") for name, node in NODES.items()}


@pytest.fixture
def caches(tmp_path):
    for name in ("warm", "cold"):
        (tmp_path / name).mkdir()
    (tmp_path / "warm" / "f.nbc").touch()
    return tmp_path


def test_every_check_of_the_configuration_is_one_and_says_what_to_do(made):
    for name in NODES:
        if name != "short_run":  # below
            assert isinstance(made[name], Check)
            finding = made[name].check()
            assert finding.word in (PASS, WARN, FAIL) and finding.found
            assert bool(finding.action) == (finding.word != PASS)


CASES = [
    ("versions", ("3.12.4", ()), PASS, "as in requirements.lock"),
    ("versions", ("3.11.0", ("numpy 1.0, locked 2.0",)), WARN, "numpy 1.0, locked 2.0"),
    ("versions", ("3.11.0", None), WARN, "no requirements.lock"),
    ("versions", ("3.10.9", ()), FAIL, "Python 3.10.9"),
    ("versions", ("3.14.0", ()), FAIL, "Python 3.14.0"),
    ("terminal", ("utf-8", "UTF-8", None), PASS, "no terminal"),
    ("terminal", ("utf8", "UTF-8", 80), PASS, "80 columns"),
    ("terminal", ("utf-8", "UTF-8", 79), WARN, "79 columns"),
    ("terminal", ("ascii", "UTF-8", 200), WARN, "ascii"),
    ("clock", (Clocks(1e-9, 1e-5, True),), PASS, "set by NTP"),
    ("clock", (Clocks(1e-9, 1e-5, None),), PASS, "cannot be read"),
    ("clock", (Clocks(1e-9, 1e-5, False),), WARN, "not set by NTP"),
    ("clock", (Clocks(1e-9, 0.2, True),), WARN, "jumped by 200 ms"),
    ("clock", (Clocks(0.016, 0.0, True),), FAIL, "monotonic"),
    ("disk", (HERE, 1e5, True), PASS, "100.0 GB"),
    ("disk", (HERE, 1999.0, True), WARN, "2.0 GB"),
    ("disk", (HERE, 49.0, True), FAIL, "0.0 GB"),
    ("disk", (HERE, 1e5, False), FAIL, "cannot be written"),
    ("recordings", (str(CONF), {"a": "config.yaml"}), PASS, "there: a"),
    ("recordings", (str(CONF), {"a": "config.yaml", "b": "nowhere"}), WARN, "there: a"),
    ("recordings", (None, {"b": "nowhere"}), WARN, "is not set"),
    ("recordings", ("/nowhere", {}), FAIL, "/nowhere is no folder"),
    ("short_run", (1.0, None), PASS, "1.0 s"),
    ("short_run", (50.0, None), WARN, "50.0 s"),
    ("short_run", (1.0, "it broke"), FAIL, "it broke"),
]


@pytest.mark.parametrize(("name", "read", "word", "said"), CASES)
def test_what_is_read_is_judged(made, name, read, word, said):
    finding = made[name].judge(*read)
    assert finding.word == word and said in finding.found and bool(finding.action) == (word != PASS)


@pytest.mark.parametrize(("folder", "word"), [("warm", PASS), ("cold", WARN), ("nowhere", FAIL)])
def test_the_cache_of_compiled_functions_is_judged(made, caches, folder, word):
    assert made["compile_cache"].judge(caches / folder).word == word


def test_every_judged_check_can_pass_and_fall_short(made):
    """The table above is whole: no check that cannot say both."""
    words = {name: {word for other, _, word, _ in CASES if other == name} for name in {name for name, *_ in CASES}}
    assert all(PASS in found and len(found) > 1 for found in words.values())


def test_a_short_run_runs_and_one_that_cannot_is_a_finding(made, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert made["short_run"].check().word in (PASS, WARN)
    broken = instantiate({**NODES["short_run"], "words": ["sensor=nonesuch"]}, _convert_="all").check()
    assert broken.word == FAIL and "sensor=nonesuch was given, but sensor can be" in broken.found
    assert list(tmp_path.iterdir()) == []


def test_the_report_says_the_worst():
    findings = [Finding("a", PASS, "well"), Finding("b", WARN, "so so", "mend it")]
    assert worst(findings) == WARN and worst(findings[:1]) == PASS
    document = json.loads(to_json(findings))
    assert (document["schema"], document["word"]) == ("oio.doctor/1", WARN)
    assert document["findings"][1] == {"name": "b", "word": WARN, "found": "so so", "action": "mend it"}


class Says:
    """A check that finds this word."""

    def __init__(self, word):
        self._word = word

    def check(self):
        return Finding("it", self._word, "found", "" if self._word == PASS else "do this")


@pytest.mark.parametrize(("words", "code"), [((PASS,), 0), ((PASS, WARN), 0), ((FAIL, PASS), 3)])
def test_the_code_is_3_only_for_a_fail(monkeypatch, capsys, words, code):
    monkeypatch.setattr(command, "_checks", lambda: map(Says, words))
    assert command.main([]) == code
    assert capsys.readouterr().out.count("it: found") == len(words)


def test_the_command_prints_json_and_finds_the_checks_of_devices(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "oio.doctor", "--json"], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert done.returncode in (0, 3), done.stderr
    assert {"ports", "rights", "rates"} <= {finding["name"] for finding in json.loads(done.stdout)["findings"]}
