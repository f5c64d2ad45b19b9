"""MCAP logs of other programs: JSON, Protobuf and ROS 2 messages as tables, and everything that is not certain refused."""

import io
import json

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from oio.core.errors import BadInput
from oio.log.foreign import as_csv, topics
from oio.log.plain_numbers import LONGEST, numbers
from tests.oio.log.ros2_bag import T0_NS, ros2_log


def json_log(rows):
    """Bytes of a log of (topic, log time [ns], message) in JSON."""
    file = io.BytesIO()
    writer, channels = Writer(file), {}
    writer.start()
    schema = writer.register_schema("any", "jsonschema", b"{}")
    for topic, t_ns, message in rows:
        if topic not in channels:
            channels[topic] = writer.register_channel(topic, "json", schema)
        writer.add_message(channels[topic], t_ns, json.dumps(message).encode(), t_ns)
    writer.finish()
    return file.getvalue()


def test_numbers_are_named_by_their_path():
    message = {"a": {"b": 1, "text": "no"}, "values": [3, 4], "ok": True, "stamp": {"sec": 5, "nanosec": 500_000_000}, "none": None}
    assert numbers(message) == {"a.b": 1.0, "values[0]": 3.0, "values[1]": 4.0, "ok": 1.0, "stamp": 5.5}
    assert numbers({"name": ["x", "y"], "position": [1.0, 2.0]}) == {"position.x": 1.0, "position.y": 2.0}
    assert numbers(7) == {"value": 7.0} and numbers({"picture": [0] * (LONGEST + 1)}) == {}
    deep = {"a": 1}
    for _ in range(100):
        deep = {"a": deep}
    assert numbers(deep) == {}


def test_another_topic_is_interpolated_to_the_rows():
    rows = [("/gas", 1_500 + 1_000 * i, {"ppm": i}) for i in range(3)] + [("/q", 1_000 * i, {"a": 10.0 * i}) for i in range(4)]
    lines = as_csv(json_log(rows), "my.mcap", "/gas.ppm").decode().splitlines()
    assert lines[0] == "log_time [ns],/gas.ppm,/q.a"
    assert lines[1:] == ["1500,0.0,15.0", "2500,1.0,25.0", "3500,2.0,nan"]  # nothing is known after the last


def test_a_message_may_lack_a_number():
    found, _ = topics(json_log([("/a", 1, {"x": 1}), ("/a", 2, {"y": 2}), ("/a", 3, {"x": 3, "y": 3})]), "my.mcap")
    np.testing.assert_equal(found["/a"].columns, {"/a.x": [1.0, np.nan, 3.0], "/a.y": [np.nan, 2.0, 3.0]})


def test_which_topic_is_asked_where_it_is_not_certain():
    data = json_log([("/gas", 1, {"ppm": 1}), ("/q", 1, {"a": 1, "b": 1})])
    with pytest.raises(BadInput, match=r"not certain which topic.*/gas \(1 messages\): /gas.ppm; /q.*recording.columns=\[\"/gas.ppm\"\]"):
        as_csv(data, "my.mcap", None)
    with pytest.raises(BadInput, match=r"none of its topics has '/gas\.ppb'"):
        as_csv(data, "my.mcap", "/gas.ppb")
    assert as_csv(json_log([("/gas", 1, {"ppm": 1})]), "my.mcap", None).decode().endswith("\n1,1.0\n")


def test_what_cannot_be_read_is_refused():
    data = json_log([("/gas", i, {"ppm": i}) for i in range(100)])
    with pytest.raises(BadInput, match="cannot be read to its end"):
        topics(data[: len(data) // 2], "my.mcap")
    with pytest.raises(BadInput, match="without numbers"):
        as_csv(json_log([("/text", 1, {"said": "hello"})]), "my.mcap", None)
    file = io.BytesIO()
    writer = Writer(file)
    writer.start()
    channel = writer.register_channel("/co2", "cdr", writer.register_schema("std_msgs/msg/Float32", "ros2idl", b"?"))
    writer.add_message(channel, 1, b"", 1)
    writer.finish()
    with pytest.raises(BadInput, match="/co2: ROS 2 messages need the package mcap-ros2-support"):
        as_csv(file.getvalue(), "my.mcap", None)


def test_joint_states_of_ros_2_are_named_by_their_joints(tmp_path):
    ros2_log(tmp_path / "bag.mcap")
    found, undecoded = topics((tmp_path / "bag.mcap").read_bytes(), "bag.mcap")
    assert undecoded == {} and set(found["/co2"].columns) == {"/co2.data"} and len(found["/co2"].t_ns) == 40
    joints = found["/joint_states"].columns
    assert set(joints) == {"/joint_states.header.stamp", "/joint_states.position.lift", "/joint_states.position.pan"}
    assert joints["/joint_states.position.pan"][100] == np.sin(1.0) and joints["/joint_states.header.stamp"][100] == 1e-9 * T0_NS + 1.0


def test_a_digit_that_was_changed_on_the_disk_is_not_read_as_data():
    """The chunk says by its CRC that it is not what was written."""
    file = io.BytesIO()
    writer = Writer(file, compression=CompressionType.NONE)
    writer.start()
    channel = writer.register_channel("/co2", "json", writer.register_schema("any", "jsonschema", b"{}"))
    for i in range(20):
        writer.add_message(channel, i, json.dumps({"ppm": 420.5}).encode(), i)
    writer.finish()
    assert as_csv(file.getvalue(), "whole.mcap", None).count(b"420.5") == 20
    with pytest.raises(BadInput, match=r"digit\.mcap .*crc"):
        as_csv(file.getvalue().replace(b"420.5", b"920.5", 1), "digit.mcap", None)


def test_a_message_that_cannot_be_decoded_is_a_row_without_a_number():
    data = json_log([("/co2", i, {"ppm": 400.0 + i}) for i in range(5)])
    file = io.BytesIO()
    writer = Writer(file)
    writer.start()
    channel = writer.register_channel("/co2", "json", writer.register_schema("any", "jsonschema", b"{}"))
    for i in range(5):
        writer.add_message(channel, i, b"{'ppm': broken" if i == 2 else json.dumps({"ppm": 400.0 + i}).encode(), i)
    writer.finish()
    whole, broken = as_csv(data, "a", None).decode().split("\n"), as_csv(file.getvalue(), "b", None).decode().split("\n")
    assert broken == [line if i != 3 else "2,nan" for i, line in enumerate(whole)] and whole[-1] == ""


@pytest.mark.parametrize(("message", "why"), [("text", "hold no numbers"), (None, "none of its 5 messages can be decoded")])
def test_a_topic_without_numbers_says_why(message, why):
    file = io.BytesIO()
    writer = Writer(file)
    writer.start()
    channel = writer.register_channel("/co2", "json", writer.register_schema("any", "jsonschema", b"{}"))
    for i in range(5):
        writer.add_message(channel, i, b"{" if message is None else json.dumps({"co2": message}).encode(), i)
    writer.finish()
    with pytest.raises(BadInput, match=f"without numbers that can be read .*{why}"):
        as_csv(file.getvalue(), "log.mcap", None)
