"""`--help`: the choices of the project and of the user's own folder, without what takes a second to load."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from oio.cli.help import asks_for_help, show_help_for
from oio.cli.help_keys import Ranges, all_choices
from oio.core.errors import BadInput

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def own(tmp_path):
    (tmp_path / "ekf").mkdir()
    (tmp_path / "ekf" / "mine.yaml").write_text("# A filter of my own.\n_target_: mine.Mine\n")
    return tmp_path


@pytest.mark.parametrize("form", ["--config-dir {}", "--config-dir={}", "-cd {}"])
def test_the_users_own_choices_are_among_them(own, capsys, form):
    words = ["--help", *form.format(own).split()]
    assert asks_for_help(words)
    show_help_for(words)
    said = capsys.readouterr().out
    assert "A filter of my own." in said and "Infrared carbon dioxide sensor" in said


def test_help_loads_no_physics_no_compiler_and_no_hydra():
    loaded = "print(sorted({'numba', 'mujoco', 'hydra', 'scipy'} & set(sys.modules)))"
    code = f"import sys; sys.argv[1:] = ['--help']; from oio import run; run.main(); {loaded}"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def said_of(capsys, *words):
    show_help_for(["--help", *words])
    return capsys.readouterr().out


@pytest.mark.parametrize("key", ["stop", "stop.sd_m", "stop.sd_m=10", "stop.sd_mm"])
def test_a_key_comes_with_its_value_its_range_and_what_it_means(capsys, key):
    if key == "stop.sd_mm":
        with pytest.raises(BadInput, match=r"there is no key stop\.sd_mm\. The nearest is stop\.sd_m\."):
            said_of(capsys, key)
        return
    said = said_of(capsys, key)
    assert "stop.sd_m=0.010   1e-05 to 1 is allowed" in said and "the root of the trace of its covariance is below this" in said
    assert ("stopping rule: the source is declared when" in said) == (key == "stop")


def test_a_choice_comes_with_all_its_keys_and_those_of_the_one_it_is_built_on(capsys):
    said = said_of(capsys, "world=disc")
    assert "world=disc" in said and "The source is a level disc" in said
    assert "world.shape=disc" in said and "along the line, normal to ring or disc" in said and "world.wall_reflects=1.0   0 to 1 is" in said


def test_a_group_is_its_default_and_a_key_of_another_choice_is_found(capsys):
    assert said_of(capsys, "ekf").startswith("ekf=ekf\n")
    assert said_of(capsys, "ekf.iterations").startswith("ekf=fixed_lag\n")
    stages = said_of(capsys, "stage")
    assert all(f"stage={path.stem}\n" in stages for path in (ROOT / "conf" / "stage").glob("*.yaml") if path.stem != "draw_ekf")
    assert "profile.max_s=300   1 to 1e+06 is allowed" in said_of(capsys, "profile.max_s")  # the range of whoever reads it


@pytest.mark.parametrize(
    ("word", "text"),
    [
        ("ekf=foo", r"there is no ekf=foo; ekf can be ckf, ekf, .*--help ekf=ckf"),
        ("recording", r"recording has no default\. Say which, e\.g\. python -m oio\.run --help recording=airscout32"),
        ("foo.bar", r"there is no key foo\.bar\..*--help alone"),
    ],
)
def test_what_does_not_exist_is_refused(capsys, word, text):
    with pytest.raises(BadInput, match=text):
        said_of(capsys, word)


def test_the_command_refuses_with_exit_code_2():
    done = subprocess.run([sys.executable, "-m", "oio.run", "--help", "ekf=foo"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 2 and done.stderr.startswith("oio: there is no ekf=foo") and done.stderr.count("\n") == 1


def test_a_choice_of_ones_own_is_explained_too(own, capsys):
    (own / "ekf" / "tight.yaml").write_text("# Tighter.\ndefaults: [ekf]\ngate_nis: 9.0  # three standard deviations\n")
    show_help_for(["--config-dir", str(own), "--help", "ekf=tight", "ekf=mine"])
    said = capsys.readouterr().out
    assert "Tighter." in said and "ekf.gate_nis=9.0   1 to 1e+09 is allowed\n    three standard deviations" in said
    assert "A filter of my own." in said
    (own / "ekf" / "torn.yaml").write_text("a: [1,\n")
    with pytest.raises(BadInput, match=r"torn\.yaml is no YAML"):
        show_help_for(["--config-dir", str(own), "--help", "ekf=tight"])


def test_help_allows_what_the_glossary_says():
    """One declaration serves the check, the help and the docs."""
    rows = re.findall(
        r"^\| `([\w.]+)` \|[^|]+\|[^|]+\| ([^|]+) \|", (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    made = all_choices((ROOT / "conf",))
    ranges, differ, compared = Ranges(made), {}, 0
    for key, allowed in rows:
        found = {
            str(ranges.of(written)) for choice in made for written in choice.at(key) if written.key == key and "${" not in written.value
        }
        if allowed != "-" and found:
            compared += 1
            if allowed not in found:  # the page names one class; those of another choice may allow less
                differ[key] = (allowed, found)
    assert not differ and compared > 200
