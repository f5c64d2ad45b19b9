"""The report of a sweep: counts of verdicts, the two figures, groups, the runs to look at."""

import json
import re
import shutil
import time
from importlib import metadata

import pytest

from oio.report.__main__ import main
from oio.report.sweep_provenance import in_ranges

pytestmark = pytest.mark.long


def test_a_sweep_has_one_page_with_links_to_its_runs(swept, tmp_path):
    out = tmp_path / "sweep.html"
    assert main([str(swept), "--out", str(out), "--figures", str(tmp_path / "figures")]) == 0
    page = out.read_text(encoding="utf-8")
    assert "sweep of 2 runs" in page and "2 of 2 runs are done." in page and page.count("<svg ") == 2
    assert {path.name for path in (tmp_path / "figures").iterdir()} >= {"heat_map.png", "distributions.svg"}
    words = [json.loads(path.read_text())["verdict"] for path in swept.glob("*/summary.json")]
    shown = dict(re.findall(r'<span class="badge \w+">(\w+)</span> (\d+)', page[: page.index("<h2>")]))
    assert {word: int(n) for word, n in shown.items()} == {word: words.count(word) for word in ("PASS", "WARN", "FAIL")}
    asked = [c["action"] for path in swept.glob("*/summary.json") for c in json.loads(path.read_text())["criteria"] if c["action"]]
    assert asked and "What to do next" in page[: page.index('id="errors"')] and "(declared: 2 runs)" in page
    for link in re.findall(r'<a href="(\d[^"]*)"', page):
        assert (swept / link).exists()


def test_the_provenance_of_a_sweep_is_whole(swept, tmp_path):
    out = tmp_path / "sweep.html"
    assert main([str(swept), "--out", str(out)]) == 0
    body = out.read_text(encoding="utf-8").partition('id="provenance"')[2].partition("<tbody>")[2].replace("<wbr>", "")
    cells = [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in re.findall(r"<tr>(.*?)</tr>", body, re.DOTALL)]
    shown = {name: value for name, value in (row for row in cells if len(row) == 2)}
    assert shown["seeds"] == "4" and shown["version of numpy"] == metadata.version("numpy")
    assert re.fullmatch(r"[0-9a-f]{40}(-dirty)?|no git|no commit", shown["commit"])
    assert "python -m oio.run -m" in shown["command"]


def test_two_hundred_runs_are_told_in_seconds_and_in_few_bytes(swept, tmp_path):
    out, told = tmp_path / "many", json.loads((swept / "sweep.json").read_text())
    out.mkdir()
    jobs = [told["jobs"][i % 2] for i in range(200)]
    told["jobs"] = [{**job, "number": i, "folder": f"{i}_run"} for i, job in enumerate(jobs)]
    for job, copy in zip(jobs, told["jobs"], strict=True):
        shutil.copytree(swept / job["folder"], out / copy["folder"])
    (out / "sweep.json").write_text(json.dumps(told))
    began = time.process_time()
    assert main([str(out), "--out", str(tmp_path / "many.html")]) == 0
    assert time.process_time() - began < 30.0 and (tmp_path / "many.html").stat().st_size < 10_000_000
    assert "200 of 200 runs are done." in (tmp_path / "many.html").read_text()


def test_a_job_that_failed_is_the_first_to_look_at(swept, tmp_path):
    status = next(path for path in sorted(swept.glob("*/status.json")))
    before = status.read_text()
    status.write_text(json.dumps({"state": "failed", "error": "no <gas>", "traceback": ""}))
    try:
        assert main([str(swept), "--out", str(tmp_path / "sweep.html")]) == 0
    finally:
        status.write_text(before)
    page = (tmp_path / "sweep.html").read_text()
    assert "1 of 2 runs are done." in page and "not done: failed" in page and 'class="lead fail"' in page


@pytest.mark.parametrize(("numbers", "words"), [([], "not known"), ([3], "3"), ([0, 1, 2, 5, 7, 8], "0 to 2, 5, 7 to 8")])
def test_seeds_are_told_as_ranges(numbers, words):
    assert in_ranges(numbers) == words
