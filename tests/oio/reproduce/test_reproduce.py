"""A run is made again from its log: equal to the bit, or the command says what differs; 0, 3 and 2 are its exit codes."""

import json
import os
import shutil
import signal
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from oio.cli import compose as composing
from oio.cli import git_state
from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.execute import execute
from oio.core.folders import CONF
from oio.log import read_metadata, schemas
from oio.reproduce.__main__ import main
from oio.reproduce.configuration import differing_keys
from oio.reproduce.original import differing, original

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[3]
FEW = ("stage.calibrate_bouts.moves_per_rung=2", "stage.map_beliefs.repeats=2", "stage.map_beliefs.budget_s=0")
TINY = ("sensor=ndir", "dof=3", "seed=3", "stage.navigate.max_moves=10", *FEW)


def run(folder, *words):
    composed = compose(words, ())
    execute(build(composed.cfg, composed.choices, list(words)), folder, quiet=True)
    return folder


@pytest.fixture(autouse=True)
def signals():
    """The command installs handlers of its own."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return run(tmp_path_factory.mktemp("runs") / "made", *TINY)


@pytest.fixture
def reproduced(tmp_path, capsys):
    """reproduced(RUN, ...) is the exit code and what was said."""

    def reproduce(given, *words):
        code = main([str(given), *words, "--out", str(tmp_path / "again")])
        said = capsys.readouterr()
        return code, said.out + said.err

    return reproduce


def rewritten(log, out, change):
    """The same log with every message as `change(topic, data)` has it, and the metadata as change("metadata", ...) has them."""
    with log.open("rb") as source, out.open("wb") as sink:
        reader, writer = make_reader(source), Writer(sink)
        writer.start()
        for metadata in reader.iter_metadata():
            writer.add_metadata(metadata.name, change("metadata", dict(metadata.metadata)))
        for attachment in reader.iter_attachments():
            writer.add_attachment(attachment.create_time, attachment.log_time, attachment.name, attachment.media_type, attachment.data)
        channels = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.topic not in channels:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, schema_id)
            data = change(channel.topic, message.data)
            writer.add_message(channels[channel.topic], message.log_time, data, message.publish_time, message.sequence)
        writer.finish()
    return out


def test_a_simulated_run_is_equal_to_the_bit_from_its_folder_and_from_its_log_alone(made, reproduced, tmp_path):
    code, said = reproduced(made)
    assert code == 0 and said.splitlines()[-1] == "EQUAL" and "run again" in said
    assert "beliefs: " in said and "beliefs: 0" not in said and "summary.json: equal" in said and "differs" not in said
    alone = shutil.copy(made / "run.mcap", tmp_path / "moved.mcap")
    shutil.rmtree(tmp_path / "again")
    code, said = reproduced(alone)
    assert code == 0 and "summary.json: only now" in said and "calibration.yaml: equal" in said


def test_a_replay_is_replayed(made, reproduced, tmp_path):
    replay = run(tmp_path / "replay", *TINY, "backend=replay", f"backend.log={made / 'run.mcap'}")
    code, said = reproduced(replay)
    assert code == 0 and "replayed: " in said and "differs" not in said


def test_a_recording_is_replayed_without_its_files(reproduced, tmp_path, monkeypatch):
    if not (Path(os.environ.get("OIO_DATA", "data")) / "co2_scd30x4").is_dir():
        pytest.skip("no recordings here: OIO_DATA names no folder that has them")
    made = run(
        tmp_path / "made",
        "backend=recording",
        "recording=co2_scd30x4",
        "sensor=ndir",
        "stage=[warm_up,baseline]",
        "stage.warm_up.max_s=600",
    )
    monkeypatch.setenv("OIO_DATA", str(tmp_path))
    code, said = reproduced(made)
    assert code == 0, said
    assert "replayed: " in said and "readings: 0" not in said


def test_a_key_that_was_changed_since_is_named_and_the_run_is_different(made, reproduced, tmp_path, monkeypatch):
    conf = tmp_path / "conf"
    shutil.copytree(CONF, conf)
    navigate = conf / "stage" / "navigate.yaml"
    navigate.write_text(navigate.read_text().replace("dwell_s: 0.3 ", "dwell_s: 0.4 "))
    monkeypatch.setattr(composing, "CONF", conf)
    composing._compose.cache_clear()
    try:
        code, said = reproduced(made)
    finally:
        composing._compose.cache_clear()
    assert code == 3 and said.splitlines()[-1] == "DIFFERENT"
    assert "configuration differs: stage.navigate.dwell_s 0.3 -> 0.4\n" in said and "beliefs: number " in said


def test_a_belief_that_was_tampered_with_is_found(made, reproduced, tmp_path):
    seen = []

    def change(topic, data):
        seen.append(topic)
        if topic != "/estimate/state" or seen.count(topic) != 2:
            return data
        state = schemas.State.FromString(data)
        state.mean[0] = np.nextafter(state.mean[0], 1.0)  # by one bit
        return state.SerializeToString()

    code, said = reproduced(rewritten(made / "run.mcap", tmp_path / "run.mcap", change))
    assert code == 3 and "beliefs: number 1 differs" in said and "innovations: 0" not in said


@pytest.mark.parametrize(
    ("name", "before", "after"), [("summary.json", '"moves": ', '"moves": 1'), ("calibration.yaml", "value: ", "value: 1")]
)
def test_a_result_that_was_tampered_with_is_found(made, reproduced, tmp_path, name, before, after):
    shutil.copytree(made, tmp_path / "made")
    path = tmp_path / "made" / name
    path.write_text(path.read_text().replace(before, after, 1))
    code, said = reproduced(tmp_path / "made")
    assert code == 3 and f"{name}: differs in" in said


def test_what_a_log_says_is_data(made, reproduced, tmp_path):
    """No class that a log names is built, neither in its overrides nor in its configuration."""
    evil = ["+x._target_=os.getcwd", "search._target_=os.getcwd", "+y={_target_:os.getcwd}", "hydra.run.dir=elsewhere", *TINY]

    def change(topic, data):
        if topic != "metadata":
            return data
        return {**data, "overrides": json.dumps(evil), "config": data["config"].replace("oio.search.d_optimal", "os")}

    code, said = reproduced(rewritten(made / "run.mcap", tmp_path / "run.mcap", change))
    assert code == 0, said
    assert "configuration differs: search._target_ os.DOptimal -> oio.search.d_optimal.DOptimal" in said
    assert json.loads(read_metadata(tmp_path / "again" / "run.mcap")["overrides"]) == list(TINY)


def test_bad_input_is_refused_before_anything_runs(made, reproduced, tmp_path):
    (tmp_path / "unfinished").mkdir()
    (tmp_path / "unfinished" / "run.mcap.part").touch()
    for given, says in ((tmp_path, "holds no run.mcap"), (tmp_path / "unfinished", "oio.recover"), (ROOT / "README.md", "not an MCAP")):
        code, said = reproduced(given)
        assert code == 2 and says in said
    assert main([str(made), "--out", str(tmp_path / "unfinished")]) == 2
    code, said = reproduced(made, "dof=7")
    assert code == 2 and "dof=7 is not on the ladder" in said
    assert not (tmp_path / "again").exists()


def test_words_win_over_those_of_the_log(made, reproduced):
    code, said = reproduced(made, "seed=4")
    assert code == 3 and "configuration differs: seed 3 -> 4" in said


def test_the_new_folder_is_beside_the_run_and_never_an_old_one(made, tmp_path, capsys):
    quick = run(tmp_path / "quick", "sensor=ndir", "dof=1", "stage=[warm_up]")
    assert [main([str(quick)]) for _ in range(2)] == [0, 0]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["quick", "quick_again", "quick_again2"]
    capsys.readouterr()


def test_versions_and_keys_that_differ_are_named():
    assert differing({"numpy": "1", "git": "a"}, {"numpy": "2", "git": "a", "mcap": "1"}) == ["numpy 1 -> 2", "mcap - -> 1"]
    assert differing_keys({"a": {"b": 1, "c": [1, 2]}, "x": 1}, {"a": {"b": 2, "c": [1, 2]}, "y": {}}, ["x"]) == [
        "a.b 1 -> 2",
        "y nothing -> {}",
    ]


def test_the_original_is_known_by_what_its_log_says(made):
    assert original(made).simulated and original(made).versions["git"] == git_state.commit()
