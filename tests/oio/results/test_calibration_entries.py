"""A calibration file is data: what it holds is found by dotted key, what is wrong with it is refused with that key."""

import math

import pytest
import yaml

from oio.core.errors import BadInput
from oio.results.calibration_entries import calibration_entries, read_calibration

TEXT = """
schema: oio.results.calibration/1
created: {by: someone, value: not a quantity, because this section is unknown}
sensor:
  element_0:
    baseline: {value: 2, u: 0.1, unit: ppm, dof: 4.0, method: A}
    gain: {value: 1.0, u: 0.0, unit: '1', dof: null, method: B}
  tau_rise: {value: 2.5, u: 0.1, unit: s}
range_law:
  air: isotropic
  wind_x: {value: -0.5, u: 0.2, unit: 1/m, dof: 10, method: A}
arm:
  pan:
    offset: {value: 0.1, u: 0.4, unit: deg, dof: 10, method: A}
type_a:
- rung: 3
  window: 7
  u_a: {value: 0.5, u: 0.2, unit: ppm, dof: 2, method: A}
  u_a_paper: 0.7
type_b: {rms: {value: 0.01, u: 0.002, unit: m, dof: 7, method: A}, misses_m: [0.1, 0.2]}
filter: {assembly: gum}
paper_values: {u_a: {value: 0.5, unit: ppm}}
"""


def changed(*path, to=None):
    """The text with one entry set, or removed."""
    document = yaml.safe_load(TEXT)
    node = document
    for key in path[:-1]:
        node = node[key]
    if to is None:
        del node[path[-1]]
    else:
        node[path[-1]] = to
    return yaml.safe_dump(document)


def test_quantities_are_found_by_their_dotted_keys():
    entries = calibration_entries(TEXT, "monday")
    assert list(entries.quantities) == [
        "sensor.element_0.baseline", "sensor.element_0.gain", "sensor.tau_rise", "range_law.wind_x", "arm.pan.offset",
        "type_a.rung_3.u_a", "type_b.rms",
    ]  # fmt: skip
    baseline = entries.quantities["sensor.element_0.baseline"]
    assert (baseline.value, baseline.u, baseline.unit, baseline.dof) == (2.0, 0.1, "ppm", 4.0)
    assert entries.quantities["sensor.element_0.gain"].dof == entries.quantities["sensor.tau_rise"].dof == math.inf
    assert entries.joints == ("pan",) and entries.elements == 1


def test_facts_are_what_has_no_uncertainty():
    facts = calibration_entries(TEXT, "monday", {"sensor": "ec"}).facts
    assert facts == {"sensor": "ec", "air form": "isotropic", "assembly": "gum", "elements": "1", "dof": "1", "joints": "pan"}


def test_what_a_file_holds_for_is_a_fact():
    held = "holds_for: {sensor: ndir, arm: so101, profile: paper, air: still, joints: [pan]}\n"
    facts = calibration_entries(TEXT + held, "monday", {"sensor": "ec"}).facts
    assert [facts[name] for name in ("sensor", "arm", "profile", "air")] == ["ndir", "so101", "paper", "still"]


def test_unknown_sections_and_fields_are_left_alone():
    plain = calibration_entries(TEXT, "monday")
    more = calibration_entries(changed("sensor", "serial", to="A-17") + "verdict: {word: PASS, value: .nan}\n", "monday")
    assert more.quantities == plain.quantities and more.facts == plain.facts


GAIN = ("sensor", "element_0", "gain")
REFUSED = [
    ((*GAIN, "unit"), None, "sensor.element_0.gain.unit is missing, but a quantity has a unit as text"),
    ((*GAIN, "unit"), 3, "sensor.element_0.gain.unit is 3, but"),
    ((*GAIN, "value"), None, "sensor.element_0.gain.value is missing, but it must be a finite number."),
    ((*GAIN, "value"), "1.0", "sensor.element_0.gain.value is '1.0', but it must be a finite number."),
    ((*GAIN, "value"), math.nan, "sensor.element_0.gain.value is nan, but it must be a finite number."),
    ((*GAIN, "value"), True, "sensor.element_0.gain.value is True, but it must be a finite number."),
    ((*GAIN, "value"), 10**400, "sensor.element_0.gain.value is 1000000"),
    ((*GAIN, "u"), None, "sensor.element_0.gain.u is missing, but it must be a finite number, 0 or more."),
    ((*GAIN, "u"), -0.1, "sensor.element_0.gain.u is -0.1, but it must be a finite number, 0 or more."),
    ((*GAIN, "u"), math.inf, "sensor.element_0.gain.u is inf, but"),
    ((*GAIN, "dof"), -1, "sensor.element_0.gain.dof is -1, but it must be a finite number, 0 or more, or null"),
    (GAIN, 1.0, "sensor.element_0.gain is 1.0, but a quantity has value, u and unit, e.g."),
    (("type_b", "rms"), 0.1, "type_b.rms is 0.1, but a quantity has"),
    (("type_a",), [{"rung": 5, "u_a": {"value": 1.0, "u": 0.1}}], "type_a.rung_5.u_a.unit is missing"),
    (("arm",), None, "section 'arm' is missing, but it must hold quantities"),
    (("range_law",), [1, 2], "section 'range_law' is [1, 2], but"),
    (
        ("schema",),
        "oio.results.calibration/9",
        "has schema oio.results.calibration/9, but a calibration has schema oio.results.calibration/1",
    ),
]


@pytest.mark.parametrize(("path", "to", "said"), REFUSED, ids=[f"{'.'.join(path)}={to!s:.12}" for path, to, _ in REFUSED])
def test_what_is_wrong_is_refused_with_its_key(path, to, said):
    with pytest.raises(BadInput) as refused:
        calibration_entries(changed(*path, to=to), "monday")
    assert str(refused.value).startswith("monday") and said in str(refused.value)


@pytest.mark.parametrize(
    "text",
    [
        "", "42", "a: [", "- 1", "a: 2026-99-99", "[" * 800,
        "!!python/object/apply:os.system ['false']",
        "schema: oio.results.calibration/1\nsensor: &s {x: *s}\nrange_law: {a: 1}\narm: {a: 1}",
    ],
    ids=["empty", "number", "broken", "list", "no date", "deep", "object", "cycle"],
)  # fmt: skip
def test_what_is_no_calibration_is_refused(text):
    with pytest.raises(BadInput, match=r"^monday"):
        calibration_entries(text, "monday")


def test_a_file_a_folder_and_what_is_neither(tmp_path):
    (tmp_path / "calibration.yaml").write_text(TEXT, encoding="utf-8")
    by_file, by_folder = read_calibration(tmp_path / "calibration.yaml"), read_calibration(tmp_path)
    assert by_file.quantities == by_folder.quantities
    (tmp_path / "run.mcap").write_bytes(b"no log")  # it would only tell the names of sensor and profile
    assert read_calibration(tmp_path).facts == by_file.facts
    (tmp_path / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    for path in (tmp_path / "absent.yaml", tmp_path / "binary.yaml", tmp_path / "absent.mcap"):
        with pytest.raises(BadInput, match=path.name):
            read_calibration(path)


def test_what_is_needed_and_missing_is_named():
    entries = calibration_entries(TEXT, "monday")
    assert entries.need("sensor.tau_rise").value == 2.5
    with pytest.raises(BadInput, match=r"monday: sensor\.tau_fall is missing"):
        entries.need("sensor.tau_fall")
