"""The layout for Foxglove names topics and fields that a run's log has."""

import json
import re
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from oio.cli.build import build
from oio.cli.compose import compose
from oio.cli.execute import execute

ROOT = Path(__file__).resolve().parents[1]
LAYOUT = json.loads((ROOT / "docs" / "foxglove_layout.json").read_text(encoding="utf-8"))
PANELS = LAYOUT["configById"]
SHORT = (
    "sensor=ec", "dof=3", "stage.navigate.max_moves=20", "stage.map_beliefs.repeats=2", "stage.map_beliefs.budget_s=0",
    "stage.calibrate_bouts.moves_per_rung=2",
)  # fmt: skip


@pytest.fixture(scope="module")
def messages(tmp_path_factory):
    """The last message of every topic of a run, and the frames that its transforms name."""
    out = tmp_path_factory.mktemp("foxglove") / "run"
    composed = compose(SHORT, ())
    execute(build(composed.cfg, composed.choices, list(SHORT)), out, quiet=True)
    with (out / "run.mcap").open("rb") as file:
        decoded = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        return {entry.channel.topic: entry.decoded_message for entry in decoded}


def paths():
    """(topic, fields) of every path in the layout."""
    plotted = [path["value"] for panel in PANELS.values() for path in panel.get("paths", ())]
    raw = [panel["topicPath"] for panel in PANELS.values() if "topicPath" in panel]
    shown = [*PANELS["3D!scene"]["topics"], PANELS["RosOut!log"]["topicToRender"]]
    for path in (*plotted, *raw, *shown):
        topic, _, fields = re.sub(r"\{.*?\}", "", path).partition(".")
        yield topic, [field for field in fields.split(".") if field], re.findall(r"\{(\w+)==", path)


@pytest.mark.parametrize(("topic", "fields", "filters"), list(paths()))
def test_every_topic_and_field_is_in_the_log(messages, topic, fields, filters):
    topic = re.sub(r"^/gas/\w+/", "/gas/ec/", topic)  # the run's sensor; the plot has one for each
    assert topic in messages
    assert {*fields[:1], *filters} <= {field.name for field in messages[topic].DESCRIPTOR.fields}


def test_the_readings_of_every_sensor_and_element_are_plotted():
    sensors = [yaml.safe_load(path.read_text(encoding="utf-8")) for path in (ROOT / "conf" / "sensor").glob("*.yaml")]
    wanted = {f"/gas/{sensor['name']}/reading{{element=={e}}}.ppm" for sensor in sensors for e in range(sensor["elements"])}
    plots = [{path["value"] for path in panel.get("paths", ())} for panel in PANELS.values()]
    assert sensors and wanted in plots


def panels(node):
    return [node] if isinstance(node, str) else panels(node["first"]) + panels(node["second"])


def test_every_panel_is_in_the_layout_once():
    assert sorted(panels(LAYOUT["layout"])) == sorted(PANELS)


def test_the_view_is_from_a_frame_that_the_arm_hangs_from(messages):
    frames = messages["/tf"].transforms
    assert PANELS["3D!scene"]["followTf"] == frames[0].parent_frame_id == "base"
    known = {"base", *(frame.child_frame_id for frame in frames), messages["/estimate/tf"].child_frame_id}
    drawn = {entity.frame_id for topic, message in messages.items() if topic.endswith("/scene") for entity in message.entities}
    assert drawn <= known and "link3" in drawn


def test_the_verdict_is_among_the_lines_of_the_log(messages):
    assert messages["/log"].name == "verdict" and re.match(r"(PASS|WARN|FAIL)\.", messages["/log"].message)
