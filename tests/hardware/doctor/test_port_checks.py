"""The checks of serial ports judge what a folder like /sys holds; no port is opened."""

import pytest
import yaml
from hydra.utils import instantiate

from hardware.doctor.rates import timers
from oio.core.folders import CONF
from oio.doctor.finding import FAIL, PASS, WARN

NODES = yaml.safe_load((CONF / "doctor.yaml").read_text(encoding="utf-8"))
CASES = [
    ("ports", ([("/dev/ttyUSB0", "usb:0403:6001:A50285BI")],), PASS, "/dev/ttyUSB0 (a chip of FTDI, usb:0403:6001:A50285BI)"),
    ("ports", ([("/dev/ttyS0", "n/a")],), PASS, "/dev/ttyS0 (n/a)"),
    ("ports", ([],), WARN, "none"),
    ("rights", (2, {}, False), PASS, "2 of 2"),
    ("rights", (0, {}, True), PASS, "if there were any"),
    ("rights", (0, {}, False), WARN, "not in the group dialout"),
    ("rights", (2, {"/dev/ttyUSB0": "uucp"}, True), FAIL, "may not open /dev/ttyUSB0"),
    ("rates", ([], {"ttyUSB0": 1}), PASS, "ttyUSB0 1 ms"),
    ("rates", ([], {}), PASS, "no FTDI chip"),
    ("rates", ([], {"ttyUSB0": 1, "ttyUSB1": 16}), WARN, "ttyUSB1 holds answers back for 16 ms"),
    ("rates", ([1000000], {}), FAIL, "no 1000000 baud"),
]


@pytest.mark.parametrize(("name", "read", "word", "said"), CASES)
def test_what_is_read_is_judged(name, read, word, said):
    finding = instantiate(NODES[name], _convert_="all").judge(*read)
    assert finding.word == word and said in finding.found and bool(finding.action) == (word != PASS)


def test_the_group_to_join_is_that_of_the_port():
    assert "usermod -aG uucp" in instantiate(NODES["rights"]).judge(1, {"/dev/ttyUSB0": "uucp"}, False).action


def test_latency_timers_are_read_where_the_system_lists_them(tmp_path):
    for port, text in {"ttyUSB0": "16\n", "ttyUSB1": "1\n", "ttyUSB2": "?\n"}.items():
        (tmp_path / port).mkdir()
        (tmp_path / port / "latency_timer").write_text(text)
    (tmp_path / "ttyACM0").mkdir()
    assert timers(tmp_path) == {"ttyUSB0": 16, "ttyUSB1": 1}
    assert timers(tmp_path / "nowhere") == {}
