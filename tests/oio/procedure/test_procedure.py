"""A protocol in a run: its steps stand around the stages and in the log; without one nothing changes; answers are checked first."""

import json
import signal

import numpy as np
import pytest
import yaml

from oio.cli.attendant import performance
from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.execute import execute
from oio.cli.replay_overrides import replayed
from oio.core.errors import BadInput
from oio.core.folders import CONF
from oio.core.records import GasSample
from oio.log import read_metadata, read_samples, read_stages
from oio.procedure.performance import Performance
from oio.procedure.procedure import Procedure
from oio.procedure.steps import Prompt, Question, Wait, duration
from oio.procedure.written_answers import WrittenAnswers, protocol_events
from oio.reproduce.__main__ import main as reproduce

pytestmark = pytest.mark.long

QUICK = ("sensor=ndir", "dof=1", "stage=[warm_up,baseline]")
ANSWERS = {"operator": "Ada", "sensor_serial": "0012", "gas_closed": "done", "room_degc": 21.5, "undisturbed": True}
PROTOCOLS = sorted(path.stem for path in (CONF / "protocol").glob("*.yaml"))


def experiment(*words):
    composed = compose((*QUICK, *words), ())
    return build(composed.cfg, composed.choices, [*QUICK, *words])


@pytest.fixture(autouse=True)
def signals():
    """The command installs handlers of its own."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def answered(tmp_path):
    """answered(name=value, ...) is the override of a file of answers; None leaves one out."""

    def write(**changed):
        path = tmp_path / f"answers{len(list(tmp_path.glob('answers*')))}.yaml"
        path.write_text(yaml.safe_dump({key: value for key, value in {**ANSWERS, **changed}.items() if value is not None}))
        return f"protocol.answers={path}"

    return write


@pytest.mark.parametrize("name", PROTOCOLS)
def test_every_protocol_is_built_and_refuses_other_stages(composed, name):
    stages = list(composed()["stage"])
    built = build(composed(f"protocol={name}"), {"backend": "mujoco", "air": "still", "ekf": "ekf"}, []).procedure
    assert isinstance(built, Procedure) and built.name == name and built.asked
    assert sum(len(built.at(moment, stage)) for stage in stages for moment in ("before", "after")) == len(built.steps)
    with pytest.raises(BadInput, match=f"protocol={name} has the step .* but stage="):
        built.check_stages(["navigate"])


def test_places_come_from_the_configuration():
    steps = {step.name: step for step in experiment_of_all("protocol=bench", "beacon.position=[0.3,0.1,0.2]").steps}
    assert steps["beacon_placed"].asked.endswith("x 300 mm, y 100 mm, z 200 mm") and steps["source_placed"].place_m is None


def experiment_of_all(*words):
    composed = compose(words, ())
    return build(composed.cfg, composed.choices, list(words)).procedure


def test_steps_stand_around_their_stages_in_the_log_and_answers_in_the_summary(answered, tmp_path):
    document = execute(experiment("protocol=emulated", answered()), tmp_path / "run", quiet=True)
    assert document["protocol"] == {"name": "emulated", "answers": ANSWERS} and document["sensor_serial"] == "0012"
    assert yaml.safe_load((tmp_path / "run" / "calibration.yaml").read_text())["holds_for"]["serial"] == "0012"
    log = tmp_path / "run" / "run.mcap"
    events, marks = list(protocol_events(log)), {(stage, state): t_ns for t_ns, stage, state in read_stages(log)}
    names = [step.name for step in experiment("protocol=emulated", answered()).procedure.steps]
    assert [event["step"] for event in events] == [name for name in names for _ in range(2)]
    assert [event["state"] for event in events] == ["begin", "done"] * len(names)
    times = {event["step"]: event["t_ns"] for event in events if event["state"] == "done"}
    assert times["air_clears"] == 2_000_000_000 == marks["warm_up", "begin"]
    assert times["room_degc"] == marks["baseline", "end"]
    told = {event["step"]: event["answer"] for event in events if "answer" in event}
    assert told == ANSWERS and next(event["unit"] for event in events if event.get("unit")) == "degC"
    assert sum(isinstance(s, GasSample) and s.t_ns < 2_000_000_000 for s in read_samples(log)) > 10  # a wait is logged


@pytest.mark.long
def test_a_calibration_holds_for_the_serial_number_that_was_told(answered, tmp_path):
    whole = "stage=[warm_up,baseline,calibrate_bouts,map_beliefs,assemble_qr]"
    execute(experiment("protocol=emulated", answered(), whole), tmp_path / "monday", quiet=True)
    kept = tmp_path / "monday" / "calibration.yaml"
    assert yaml.safe_load(kept.read_text())["holds_for"]["serial"] == "0012"
    words = ("protocol=emulated", f"calibration={kept}", "stage=[warm_up,baseline,load_calibration]")
    execute(experiment(*words, answered()), tmp_path / "friday", quiet=True)
    with pytest.raises(BadInput, match="with serial number '0012', but this run has sensor_serial='0013'"):
        execute(experiment(*words, answered(sensor_serial="0013")), tmp_path / "other", quiet=True)


def test_a_run_without_a_protocol_and_one_that_only_asks_sense_the_same_to_the_bit(answered, tmp_path):
    plain = execute(experiment(), tmp_path / "plain", quiet=True)
    asked = experiment("protocol=emulated", answered())
    only_asks = [step for step in asked.procedure.steps if not isinstance(step, Wait)]
    object.__setattr__(asked.procedure, "steps", tuple(only_asks))
    execute(asked, tmp_path / "asked", quiet=True)
    gas = [[(s.t_ns, s.raw) for s in read_samples(tmp_path / out / "run.mcap") if isinstance(s, GasSample)] for out in ("plain", "asked")]
    assert plain["protocol"] is None and "protocol" not in read_metadata(tmp_path / "plain" / "run.mcap")["config"]
    assert len(gas[0]) > 10 and np.array_equal(*gas)


def test_its_log_answers_a_replay_and_reproduces(answered, tmp_path, capsys):
    words = ("protocol=emulated", answered(room_degc=7.25))
    execute(experiment(*words), tmp_path / "run", quiet=True)
    log = tmp_path / "run" / "run.mcap"
    (tmp_path / "answers0.yaml").unlink()
    assert f"protocol.answers='{log}'" in replayed(["backend=replay", f"backend.log={log}"])
    assert not any(word.startswith("protocol.") for word in replayed(["backend=replay", f"backend.log={log}", "protocol=bench"]))
    again = experiment(*replayed(["backend=replay", f"backend.log={log}"]))
    assert execute(again, tmp_path / "again", quiet=True)["protocol"]["answers"]["room_degc"] == 7.25
    assert reproduce([str(tmp_path / "run")]) == 0 and reproduce([str(tmp_path / "again")]) == 0
    assert "differs" not in capsys.readouterr().out


REFUSED = [
    ({"operator": None, "undisturbed": None}, "without operator, undisturbed. protocol=emulated asks for operator, sensor_serial"),
    ({"colour": "red"}, "with unknown colour"),
    ({"room_degc": 99}, "room_degc: 99 was given, but a number from 0 to 50 degC is allowed"),
    ({"sensor_serial": 12}, "sensor_serial: 12 was given, but a line of text is allowed, in quotes"),
    ({"gas_closed": True}, "gas_closed: True was given, but Enter, or done in a file is allowed"),
]


@pytest.mark.parametrize(("changed", "says"), REFUSED)
def test_wrong_answers_are_refused_before_anything_is_made(answered, tmp_path, changed, says):
    with pytest.raises(BadInput, match=says.replace(".", r"\.")):
        execute(experiment("protocol=emulated", answered(**changed)), tmp_path / "run", quiet=True)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("text", "says"), [("[1, 2]", "holds no NAME"), ("a: [", "cannot be read"), ("a: !!python/name:os.getcwd", "cannot be read")]
)
def test_a_file_of_answers_is_data(tmp_path, text, says):
    (tmp_path / "answers.yaml").write_text(text)
    with pytest.raises(BadInput, match=says):
        performance(experiment("protocol=emulated", f"protocol.answers={tmp_path / 'answers.yaml'}").procedure, unattended=True)


def test_nobody_to_ask_is_refused_at_the_start():
    procedure = experiment("protocol=emulated").procedure
    with pytest.raises(BadInput, match="a job of a sweep asks nobody"):
        performance(procedure, unattended=True)
    with pytest.raises(BadInput, match=r"there is no terminal.*protocol\.answers=FILE"):
        performance(procedure, unattended=False)  # the tests have none
    assert performance(None, unattended=True) is None


class Slow(WrittenAnswers):
    """Answers at the third look."""

    looks = 0

    def answer(self, step):
        self.looks += 1
        return super().answer(step) if self.looks % 3 == 0 else None


class World:
    """Lives: every look gives one more sample."""

    def __init__(self):
        self.t_ns, self.spans, self.looks = 0, [], 0

    def attend(self, is_done):
        self.spans.append(0.0)
        while not is_done():
            self.t_ns += 1

    def samples(self, for_s):
        self.spans.append(for_s)
        return iter(())


def test_a_person_may_take_time_and_it_is_one_span():
    steps = (
        Prompt(name="open", when={"before": "a"}, text="Open", place_m=(0.1, 0.0, 0.2)),
        Wait(name="rest", when={"before": "a"}, text="Rest", for_s=90.0),
    )
    procedure, world, written = Procedure(name="p", title="P", answers=None, steps=steps), World(), []
    operator = Slow({"open": "done"})
    Performance(procedure, operator)("before", "a", world, type("Log", (), {"write": staticmethod(written.append)}))
    assert operator.looks == 3 and world.spans == [0.0, 90.0] and world.t_ns == 2
    assert json.loads(written[0].text)["text"] == "Open: x 100 mm, y 0 mm, z 200 mm"
    assert json.loads(written[2].text)["text"] == "Rest: 1 min 30 s" and duration(120.0) == "2 min"


@pytest.mark.parametrize(
    ("step", "says"),
    [
        ({"name": "A b"}, "a name is of small letters"),
        ({"when": {}}, "before or after is needed"),
        ({"when": {"during": "warm_up"}}, "before or after is needed"),
        ({"for_s": 0.0}, "0.1 to 86400"),
    ],
)
def test_a_step_that_is_none_is_refused(step, says):
    with pytest.raises(BadInput, match=says):
        Wait(**{"name": "rest", "when": {"before": "warm_up"}, "text": "Rest", "for_s": 1.0, **step})


def test_names_are_given_once():
    steps = tuple(
        Question(name="a", when={"before": "b"}, text="?", answer=experiment("protocol=emulated").procedure.asked[0].answer) for _ in "12"
    )
    with pytest.raises(BadInput, match="two steps of the name a"):
        Procedure(name="p", title="P", answers=None, steps=steps)
