"""The report of a run: verdict and next action first, everything in one file, refused where there is nothing to report."""

import errno
import hashlib
import html
import json
import re
import shutil
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

from oio.report.__main__ import main
from oio.report.material import Material
from oio.report.verdict_part import answer

pytestmark = pytest.mark.long

PARTS = ("criteria", "place", "signal", "sensor", "filter", "nose", "calibration", "truth", "assumptions", "provenance")
FIGURES = ("search", "source_error", "error_over_bound", "readings", "allan", "step", "nis", "residuals", "nose")


def text_of(path):
    page = re.sub(r"<(script|style)\b.*?</\1>", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    return html.unescape(re.sub(r"<[^>]+>", " ", page.replace("<wbr>", "")))


@pytest.fixture(scope="module")
def report(made):
    folder, done = made
    assert done.returncode in (0, 3), done.stderr
    return folder / "report.html"


def test_a_run_ends_with_its_report(made, report):
    assert f"report: {report}" in made[1].stdout
    assert report.stat().st_size < 3_000_000


def test_verdict_answer_and_next_action_come_first(made, report):
    summary, text = json.loads((made[0] / "summary.json").read_text()), text_of(report)
    order = [text.index(word) for word in (summary["verdict"], "The source is at", "What to do next", "Each criterion")]
    assert order == sorted(order)
    first = next(c for word in ("FAIL", "WARN") for c in summary["criteria"] if c["word"] == word)
    assert text.index("What to do next") < text.index(first["action"]) < text.index("Each criterion")
    assert all(c["found"].replace("+-", "\N{PLUS-MINUS SIGN}") in text and c["name"] in text for c in summary["criteria"])


def test_every_part_and_figure_is_there_and_linked(report):
    page = report.read_text(encoding="utf-8")
    for anchor in PARTS:
        assert f'<section id="{anchor}">' in page and f'href="#{anchor}"' in page
    for name in FIGURES:
        assert f'<figure id="{name}">' in page
    assert page.count("<svg ") == len(FIGURES)


def test_nothing_is_fetched_from_elsewhere(report):
    page = re.sub(r"<script\b.*?</script>", "", report.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert not re.findall(r'(?:src|href)="(?!#|data:)[^"]*"', page) and "@import" not in page
    assert all(not link.startswith("http") for link in re.findall(r"url\(([^)]*)\)", page))


def test_numbers_stand_with_uncertainty_and_unit(report):
    text = text_of(report)
    for words in ("sensor.element_0.baseline", "ppm", "sensor.tau_rise", "air.exponent", "arm.shoulder_azimuth.offset", "Table I"):
        assert words in text


def test_a_prior_that_the_readings_did_not_touch_is_no_type_a(report):
    """The wrist turns the nose about its own axis: no reading tells its offset."""
    page = report.read_text(encoding="utf-8")
    row = next(row for row in re.findall(r"<tr>.*?</tr>", page) if "sensor.<wbr>element_<wbr>0.<wbr>gain" in row)
    assert re.findall(r"<td[^>]*>(.*?)</td>", row)[1:] == ["infinite", "B"]


def test_numbers_in_figures_keep_their_digits(report):
    """Coordinates are shortened, text is not."""
    page = report.read_text(encoding="utf-8")
    assert re.search(r">rise: tau \d+\.\d{2,} ", page) and not re.search(r'x="\d+\.\d{3,}"', page)


def test_the_holes_of_the_paper_stand_with_their_keys_and_values(report):
    text = text_of(report)
    assert "bout.threshold" in text and '"max"' in text and "assembly" in text and '"gum"' in text


def test_the_provenance_is_whole(report):
    text = text_of(report)
    for words in ("version of numpy", "git", "SHA-256 of run.mcap", "sensor=mox_mics dof=3 seed=4", "The whole configuration"):
        assert words in text


def test_the_same_run_gives_the_same_bytes_and_its_figures_as_files(made, report, tmp_path):
    assert main([str(made[0]), "--out", str(tmp_path / "again.html"), "--figures", str(tmp_path / "figures")]) == 0
    assert (tmp_path / "again.html").read_bytes() == report.read_bytes()
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {
        f"{name}.{kind}" for name in (*FIGURES, "scene") for kind in ("svg", "png")
    }
    for path in (tmp_path / "figures").glob("*.svg"):
        assert ElementTree.parse(path).getroot().tag.endswith("svg")


def test_text_from_outside_is_never_markup(made, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(made[0], folder)
    summary = json.loads((folder / "summary.json").read_text())
    summary["criteria"][0].update(
        name="<script>alert(1)</script>", found='"><img src=x onerror=alert(1)>', word="FAIL", action="<b>act</b>"
    )
    (folder / "summary.json").write_text(json.dumps(summary))
    assert main([str(folder)]) == 0
    page = (folder / "report.html").read_text()
    assert "<script>alert" not in page and "<img" not in page and "<b>act" not in page and "&lt;b&gt;act" in page


@pytest.fixture(scope="module")
def clean_air(tmp_path_factory, command):
    """The folder of a run without a source."""
    folder = tmp_path_factory.mktemp("report") / "clean"
    done = command("sensor=mox_mics", "dof=3", "stage=[warm_up,baseline]", f"hydra.run.dir={folder}")
    assert done.returncode in (0, 3), done.stderr
    return folder


def test_the_files_that_were_read_have_their_hashes(tmp_path, command):
    log = tmp_path / "lab.csv"
    rows = np.random.default_rng(1).normal(400.0, 2.0, 120)
    log.write_text("time [s],co2 [ppm]\n" + "".join(f"{i},{ppm:.1f}\n" for i, ppm in enumerate(rows)))
    words = "backend=recording", "recording=csv", f"recording.file={log}", "sensor=ndir", "stage=[warm_up,baseline]"
    done = command(*words, f"hydra.run.dir={tmp_path / 'run'}")
    assert done.returncode in (0, 3), done.stderr
    told = f"input {log} {log.stat().st_size} bytes, SHA-256 {hashlib.sha256(log.read_bytes()).hexdigest()}"
    assert told in " ".join(text_of(tmp_path / "run" / "report.html").split())


def test_the_arm_ends_at_the_nose_of_the_calibrated_filter(made):
    """Its joints are the filter's: those of the encoders alone end where drift has taken them."""
    story = Material.read(made[0]).story
    np.testing.assert_allclose(story.links_m[-1], story.odometry.p_m[-1], atol=2e-3)
    assert np.linalg.norm(story.dead.p_m[-1] - story.odometry.p_m[-1]) > 5e-3


def test_parts_without_anything_to_show_are_left_out(clean_air):
    page = (clean_air / "report.html").read_text(encoding="utf-8")
    assert set(re.findall(r'<section id="(\w+)">', page)) == {
        "criteria", "signal", "sensor", "calibration", "words", "assumptions", "provenance",
    }  # fmt: skip
    assert 'id="plotly"' not in page and len(page) < 500_000


def test_with_one_joint_the_answer_is_a_direction(made):
    story = SimpleNamespace(dof=1, shoulder_m=np.array([0.1, 0.0, 0.0]), left=((np.array([0.2, 0.1, 0.0]), 1e-4 * np.eye(3)),))
    outcome = {"believed_m": [0.2, 0.1, 0.0], "sd_m": 0.2, "moves": 9, "time_s": 7.0, "other_places": [{}], "found": False}
    told = answer(SimpleNamespace(summary={"calibrated": outcome}, story=story))
    assert "azimuth 45.0 \N{PLUS-MINUS SIGN} 4.1 deg" in told and "1 other place explains" in told and " mm" not in told


def test_a_run_that_only_calibrates_has_its_report(made, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(made[0], folder)
    summary = json.loads((folder / "summary.json").read_text())
    summary.update(calibrated=None, scored=None, criteria=summary["criteria"][:3], verdict="PASS", verdicts={"calibration": "PASS"})
    (folder / "summary.json").write_text(json.dumps(summary))
    assert main([str(folder)]) == 0
    assert "Nothing was searched for" in text_of(folder / "report.html") and 'id="truth"' not in (folder / "report.html").read_text()


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda folder: shutil.rmtree(folder), "there is no such folder"),
        (lambda folder: (folder / "run.mcap").unlink(), "made with logging=summary"),
        (lambda folder: (folder / "run.mcap").rename(folder / "run.mcap.part"), "python -m oio.recover"),
        (lambda folder: (folder / "run.mcap").write_bytes(b"x"), "not an MCAP file"),
        (lambda folder: (folder / "summary.json").write_text("[]"), "not of schema"),
        (lambda folder: (folder / "calibration.yaml").write_text("{"), "is no plain YAML"),
    ],
)
def test_what_cannot_be_reported_is_refused_in_one_paragraph(made, tmp_path, capsys, spoil, says):
    folder = tmp_path / "run"
    shutil.copytree(made[0], folder)
    spoil(folder)
    assert main([str(folder)]) == 2
    said = capsys.readouterr().err
    assert says in said and said.count("\n") == 1


def test_a_file_that_cannot_be_written_is_refused(made, tmp_path, capsys):
    assert main([str(made[0]), "--out", str(tmp_path / "no" / "r.html")]) == 2
    assert "cannot be written" in capsys.readouterr().err


def test_on_a_full_disk_no_cut_report_stays(made, tmp_path, capsys, monkeypatch):
    def cut(path, text, encoding):
        path.write_bytes(text[:100].encode())
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_text", cut)
    out = tmp_path / "report.html"
    assert main([str(made[0]), "--out", str(out)]) == 2
    assert "report.html cannot be written (No space left on device)" in capsys.readouterr().err and not out.exists()
