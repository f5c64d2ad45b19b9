"""An arm over LeRobot, against a stand-in of its published interface (lerobot 0.6.1: registry, Robot, SO follower), not against LeRobot."""

import dataclasses
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from hardware.drivers.robots import lerobot_registry
from hardware.drivers.robots.lerobot_options import LerobotOptions
from hardware.drivers.robots.lerobot_robot import LerobotRobot
from hardware.drivers.robots.robot_arm import RobotOpener
from hardware.drivers.robots.watched_robot import WatchedRobot
from hardware.transport.clock import Clock
from hardware.transport.port import NoAnswer
from oio.core.errors import BadInput

NAMES = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
MODULE = """import dataclasses, lerobot.robots
@dataclasses.dataclass(kw_only=True)
class SOFollowerRobotConfig:
    id: str | None = None
    port: str
    disable_torque_on_disconnect: bool = True
    use_degrees: bool = False
lerobot.robots.RobotConfig.known["so101_follower"] = SOFollowerRobotConfig
"""


class StandIn:
    """LeRobot's SO follower as far as its interface goes: six motors, degrees or a share of the range."""

    is_calibrated = True

    def __init__(self, config):
        self.config, self.calls, self.sent = config, [], []
        mode = SimpleNamespace(value="degrees" if config.use_degrees else "range_m100_100")
        self.bus = SimpleNamespace(motors={name: SimpleNamespace(norm_mode=mode) for name in NAMES})
        self.bus.motors["gripper"] = SimpleNamespace(norm_mode=SimpleNamespace(value="range_0_100"))
        self.degrees, self.error = {**dict.fromkeys(NAMES, 0.0), "gripper": 50.0}, None

    @property
    def action_features(self):
        return {f"{name}.pos": float for name in self.bus.motors}

    def connect(self, calibrate=True):
        self.calls.append(("connect", calibrate))

    def get_observation(self):
        if self.error is not None:
            raise self.error
        return {**{f"{name}.pos": value for name, value in self.degrees.items()}, "camera": np.zeros((4, 4, 3))}

    def send_action(self, action):
        self.sent.append(action)
        return action

    def disconnect(self):
        self.calls.append(("disconnect",))


@pytest.fixture
def made(monkeypatch, tmp_path):
    """made(**options) gives LeRobot's robot behind ours; its modules are those of the stand-in."""
    (tmp_path / "so_follower").mkdir()
    (tmp_path / "so_follower" / "__init__.py").write_text(MODULE, encoding="utf-8")
    (tmp_path / "hope_jr").mkdir()
    (tmp_path / "hope_jr" / "__init__.py").write_text("import the_makers_own_library_of_nobody\n", encoding="utf-8")
    lerobot, robots, tools = ModuleType("lerobot"), ModuleType("lerobot.robots"), ModuleType("lerobot.utils.import_utils")
    known, robot_of = {}, {}
    registry = SimpleNamespace(known=known, get_known_choices=lambda: dict(known), get_choice_class=known.__getitem__)
    robots.RobotConfig, robots.__path__ = registry, [str(tmp_path)]
    robots.make_robot_from_config = lambda config: robot_of.setdefault("made", StandIn(config))
    tools.register_third_party_plugins = lambda: robot_of.setdefault("plug-ins", True)
    lerobot.robots, lerobot.__path__ = robots, []
    for name, module in {"lerobot": lerobot, "lerobot.robots": robots, "lerobot.utils.import_utils": tools}.items():
        monkeypatch.setitem(sys.modules, name, module)
    for name in ("lerobot.robots.so_follower", "lerobot.robots.hope_jr"):
        monkeypatch.delitem(sys.modules, name, raising=False)

    def make(names=NAMES, torque_off=False, kind="so101_follower", **options):
        given = LerobotOptions(type=kind, id="my_arm", options=options)
        ours = LerobotRobot(given, "/dev/ttyACM0", names, torque_off)
        RobotOpener(WatchedRobot(ours, Clock(1.0)), "/dev/ttyACM0", "").open()
        return ours, robot_of["made"]

    yield make
    for name in ("lerobot.robots.so_follower", "lerobot.robots.hope_jr"):
        sys.modules.pop(name, None)


def test_it_connects_without_calibrating_in_degrees_and_keeps_its_torque(made):
    ours, theirs = made()
    assert theirs.calls == [("connect", False)] and ours.describe() == "LeRobot so101_follower my_arm"
    assert dataclasses.asdict(theirs.config) == {
        "id": "my_arm", "port": "/dev/ttyACM0", "disable_torque_on_disconnect": False, "use_degrees": True,
    }  # fmt: skip
    ours.close()
    ours.close()
    assert theirs.calls[-1] == ("disconnect",) and len(theirs.calls) == 2
    assert made(torque_off=True)[0]._config.disable_torque_on_disconnect is True


def test_degrees_by_name_are_radians_in_the_order_of_the_model_and_back(made):
    names = tuple(reversed(NAMES))
    ours, theirs = made(names)
    theirs.degrees.update(zip(names, (10.0, 20.0, 30.0, 40.0, 50.0), strict=True))
    reading = ours.read()
    assert np.allclose(np.degrees(reading.q), [10.0, 20.0, 30.0, 40.0, 50.0]) and np.all(np.isnan(reading.load))
    ours.write(reading.q)
    assert theirs.sent[-1] == pytest.approx({f"{name}.pos": theirs.degrees[name] for name in names})  # and nothing for the gripper


def test_a_reading_that_its_bus_misses_is_missed_here_too(made):
    ours, theirs = made()
    theirs.error = ConnectionError("Failed to sync read 'Present_Position'")
    with pytest.raises(NoAnswer, match="Failed to sync read"):
        ours.read()


def test_what_is_not_in_degrees_is_refused(made):
    with pytest.raises(BadInput, match=r"gives joint shoulder_pan as range_m100_100, a share of the range.*use_degrees: true"):
        made(use_degrees=False)


def test_an_arm_that_is_not_calibrated_is_refused_with_lerobots_own_words(made, monkeypatch):
    monkeypatch.setattr(StandIn, "is_calibrated", False)
    with pytest.raises(BadInput, match=r"not calibrated.*lerobot-calibrate --robot\.type=so101_follower --robot\.id=my_arm --robot\.port="):
        made()


@pytest.mark.parametrize(
    "given, told",
    [
        ({"names": ("shoulder_azimuth", *NAMES[1:])}, r"has no joint shoulder_azimuth; it has shoulder_pan, .*joint_names=\[shoulder_pan,"),
        ({"kind": "so99"}, r"type=so99 was given, but LeRobot has so101_follower\. These could not be imported: lerobot\.robots\.hope_jr"),
        ({"side": "left"}, r"options has side, but LeRobot's so101_follower has no such field; it has disable_torque"),
        ({"kind": None}, r"needs the words with which the arm was calibrated.*type=so101_follower"),
    ],
)
def test_words_that_do_not_fit_are_refused(made, given, told):
    with pytest.raises(BadInput, match=told):
        made(**given)


def test_without_lerobot_it_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "lerobot.robots", None)
    with pytest.raises(BadInput, match=r"LeRobot cannot be imported.*pip install 'oio\[lerobot\]'"):
        lerobot_registry.config_class("so101_follower")
