"""Every file in conf/ is composed and built, and what it builds keeps the promises of its protocol."""

import functools
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hydra.errors import InstantiationException

from oio.core.errors import BadInput
from oio.runtime.runner import check_order
from oio.testing import check_air, check_stage

CONF = Path(__file__).resolve().parents[1] / "conf"


def names(group):
    return sorted(path.stem for path in (CONF / group).glob("*.yaml"))


def overrides_of(group, name):
    """What must be typed with a choice to make it whole."""
    if group == "arm" and name != "so101":
        return (f"arm={name}", "dof=3")
    if (group, name) == ("backend", "replay"):
        return ("backend=replay", "backend.log=outputs/no/such.mcap")
    if (group, name) == ("backend", "recording"):
        return ("backend=recording", "recording=airscout32")
    if (group, name) == ("backend", "serial"):
        return ("backend=serial", "sensor=ndir", "backend.nose.driver=scd30", "backend.nose.port=/dev/ttyUSB0")
    if name in ("imported_gas", "imported_wind"):
        return (f"air={name}", f"air.path={recorded_air()}")
    return (f"{group}={name}",)


@functools.cache
def recorded_air():
    """A file of 10 s of steady gas and wind about a source; it lasts as long as the tests."""
    path = Path(tempfile.mkdtemp()) / "air.npz"
    x = np.linspace(-1.5, 1.5, 61)
    away = np.sqrt(x[:, None, None] ** 2 + x[None, :, None] ** 2 + x[None, None, :] ** 2 + 1e-4)
    wind = np.broadcast_to(np.array([0.05, 0.0, 0.0]), (2, *away.shape, 3))
    ppm = np.broadcast_to(1.0 / away, (2, *away.shape))
    np.savez(path, t_s=[0.0, 10.0], x_m=x, y_m=x, z_m=x, wind_m_s=wind, ppm=ppm, source_m=np.zeros(3), rate_ml_s=1.0)
    return path


BUILT = ("air", "arm", "backend", "belief_map", "bout", "ekf", "search", "verdict", "view", "world")  # a choice of these is one thing
OTHERS = ("profile", "protocol", "recording", "sensor", "stage")  # built below
CHOICES = [(group, name) for group in BUILT for name in names(group)]
ADDED = [(g.name, n) for g in sorted(CONF.iterdir()) if g.is_dir() and g.name not in (*BUILT, *OTHERS, "hydra") for n in names(g.name)]


@pytest.mark.parametrize(("group", "name"), CHOICES)
def test_every_choice_is_built(built, composed, group, name):
    overrides = overrides_of(group, name)
    target = composed(*overrides)[group]["_target_"]
    assert type(built(group, *overrides)).__name__ == target.rsplit(".", 1)[1]


def test_every_group_is_looked_at():
    assert all(names(group) for group in (*BUILT, *OTHERS))


def test_what_is_added_on_top_builds_a_whole_run(built):
    """Experiments and the like: a backend, and stages in order."""
    for group, name in ADDED:
        built("backend", f"+{group}={name}")
        check_order(built("stage", f"+{group}={name}"))


@pytest.mark.parametrize("profile", names("profile"))
@pytest.mark.parametrize("sensor", names("sensor"))
def test_every_sensor_has_every_profile(built, composed, sensor, profile):
    overrides = (f"sensor={sensor}", f"profile={profile}")
    made = built("sensor", *overrides)
    assert made.name == sensor
    assert made.sample_s == composed(*overrides).profile[sensor].sample_s
    assert built("nominal", *overrides).rise_s == made.tau_rise_s


@pytest.mark.parametrize("recording", names("recording"))
def test_every_recording_makes_a_backend(built, recording):
    made = built("backend", "backend=recording", f"recording={recording}", "arm=gantry", "dof=3")
    assert made.recording.name == recording


@pytest.mark.parametrize("stage", names("stage"))
def test_every_stage_keeps_its_promises(built, stage):
    check_stage(built("stage", f"stage=[{stage}]")[stage])


def test_the_default_stages_are_in_order_and_a_wrong_order_is_not(built):
    check_order(built("stage"))
    with pytest.raises(BadInput, match="'navigate' needs Calibration"):
        check_order(built("stage", "stage=[warm_up,baseline,navigate]"))


def test_a_stage_left_out_is_named(built):
    with pytest.raises(BadInput, match="'evaluate' needs"):
        check_order(built("stage", "stage=[warm_up,baseline,evaluate]"))


@pytest.mark.parametrize("air", names("air"))
def test_every_air_keeps_its_promises(built, air):
    check_air(built("air", *overrides_of("air", air)))


@pytest.mark.parametrize(
    "key", ["beacon", "source", "climate", "range_law", "nominal", "process_noise", "belief_map", "bout", "seeds", "safety"]
)
def test_every_key_of_the_root_is_built(built, composed, key):
    assert type(built(key)).__name__ == composed()[key]["_target_"].rsplit(".", 1)[1]


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("arm.joint_speed=fast", "Arm.joint_speed"),
        ("+arm.colour=red", "colour"),
        ("~arm.backlash_deg", "backlash_deg"),
        ("sensor.elements=3", "elements is 3"),
        ("dof=4", "It can be 1, 2, 3, 5"),
    ],
)
def test_mistakes_are_refused_with_their_key(built, override, said):
    with pytest.raises((InstantiationException, BadInput), match=said):
        built("backend", override)
