"""Clocks, mailbox, ports, and a device thread that loses its port and finds it again."""

import contextlib
import fcntl
import os
import re
import select
import threading
import time
import tty
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware.codecs.line import Lines, sentence
from hardware.transport import discovery
from hardware.transport.clock import JUMP_S, WRAP_MS, Clock, DeviceClock, suspended_ns
from hardware.transport.device import Device
from hardware.transport.driver import Timeouts
from hardware.transport.mailbox import Mailbox, StampedSample
from hardware.transport.opener import SerialOpener
from hardware.transport.port import NoAnswer, Unplugged, open_port
from hardware.transport.request import request, request_until
from oio.core.errors import BadInput, OioError
from oio.core.records import SECOND_NS, GasSample

TIOCGEXCL = 0x80045440  # Linux: whether a terminal is exclusive
TIMEOUTS = Timeouts(connect_s=1.0, receive_s=0.3, reconnect_s=2.0, backoff_s=0.02, backoff_max_s=0.1)


def frames(count, period_s=0.1, skew=0.0, offset_s=3.0, jitter_s=0.005, seed=0):
    """Device ms (count,) and arrivals [ns] of frames whose delays are 2 ms and an exponential on top."""
    rng = np.random.default_rng(seed)
    sent_s = offset_s + period_s * np.arange(count)  # by the world's clock
    device_ms = np.floor(1e3 * (sent_s - offset_s) / (1.0 + skew)).astype(int)
    return device_ms, sent_s, np.rint((sent_s + 0.002 + rng.exponential(jitter_s, count)) * SECOND_NS).astype(int)


@settings(max_examples=25, deadline=None)
@given(skew=st.floats(-2e-3, 2e-3), seed=st.integers(0, 1000))
def test_a_device_clock_follows_offset_and_skew(skew, seed):
    """Jitter of 5 ms leaves less than 2 ms once a minute has passed, however fast the device's clock is."""
    ms, sent_s, arrived = frames(1200, skew=skew, seed=seed)
    clock = DeviceClock()
    stamped = np.array([clock.to_world_ns(int(m), int(a)) for m, a in zip(ms, arrived, strict=True)])
    assert np.all(np.diff(stamped) > 0) and np.all(stamped <= arrived) and clock.jumps == 0
    late_s = stamped[600:] / SECOND_NS - sent_s[600:] - 0.002  # 2 ms of delay cannot be told from the offset
    assert np.max(np.abs(late_s)) < 0.003 and clock.skew == pytest.approx(skew, abs=2e-4)


def test_when_the_line_is_fitted_changes_no_stamp():
    """`settle` only takes work off the next frame."""
    ms, _, arrived = frames(1200, skew=2e-4)
    lazy, eager = DeviceClock(), DeviceClock()
    for m, at_ns in zip(ms.tolist(), arrived.tolist(), strict=True):
        stamp_ns = eager.to_world_ns(m, at_ns)
        eager.settle()
        assert lazy.to_world_ns(m, at_ns) == stamp_ns


def test_a_frame_that_a_busy_host_read_late_is_not_late():
    ms, sent_s, arrived = frames(600)
    arrived[400] += 2 * SECOND_NS
    clock = DeviceClock()
    stamped = [clock.to_world_ns(int(m), int(a)) for m, a in zip(ms[:401], arrived[:401], strict=True)]
    assert stamped[400] / SECOND_NS == pytest.approx(sent_s[400], abs=0.004) and clock.jumps == 0


@pytest.mark.parametrize("jump_ms", [-50_000, -300, 5_000])
def test_a_device_clock_that_jumps_begins_anew_and_never_runs_backwards(jump_ms):
    ms, sent_s, arrived = frames(900)
    ms = ms + 60_000
    ms[450:] += jump_ms
    clock = DeviceClock()
    stamped = np.array([clock.to_world_ns(int(m), int(a)) for m, a in zip(ms, arrived, strict=True)])
    assert clock.jumps == 1 and np.all(np.diff(stamped) > 0) and np.all(stamped <= arrived)
    assert np.max(np.abs(stamped[700:] / SECOND_NS - sent_s[700:])) < 0.01 < JUMP_S


def test_milliseconds_wrap_after_seven_weeks():
    ms, sent_s, arrived = frames(200)
    clock = DeviceClock()
    stamped = np.array([clock.to_world_ns(int(m + WRAP_MS - 10_000) % WRAP_MS, int(a)) for m, a in zip(ms, arrived, strict=True)])
    assert clock.jumps == 0 and np.max(np.abs(stamped / SECOND_NS - sent_s)) < 0.03


@given(st.lists(st.tuples(st.integers(0, WRAP_MS - 1), st.integers(0, 10**7)), min_size=1, max_size=60))
def test_whatever_a_device_says_time_goes_on(said):
    clock, arrived, last = DeviceClock(), 0, -1
    for ms, more in said:
        arrived += more
        stamped = clock.to_world_ns(ms, arrived)
        assert stamped > last
        last = stamped


def test_the_world_clock_goes_as_fast_as_it_is_told():
    slow, quick = Clock(1.0), Clock(50.0)
    time.sleep(0.05)
    ratio = quick.now_ns() / slow.now_ns()
    assert 45.0 < ratio < 55.0 and quick.host_s(1.0) == 0.02


def test_a_full_mailbox_loses_the_oldest_and_says_so():
    box = Mailbox(3)
    for i in range(5):
        box.put(StampedSample(GasSample(i, 0, 1.0), i))
    assert [a.sample.t_ns for a in box.gas] == [2, 3, 4] and box.lost == 2


# ---- ports


def plugged(monkeypatch, *ports):
    made = [SimpleNamespace(device=d, vid=v, pid=p, serial_number=s, description="n/a") for d, v, p, s in ports]
    monkeypatch.setattr(discovery.list_ports, "comports", lambda: made)


def test_a_usb_port_is_found_by_its_numbers_wherever_it_is_plugged_in(monkeypatch):
    plugged(monkeypatch, ("/dev/ttyUSB0", 0x0403, 0x6001, "A1"), ("/dev/ttyUSB1", 0x0403, 0x6001, "B2"), ("/dev/ttyS0", None, None, None))
    assert discovery.resolve_port("usb:0403:6001:B2", "backend.nose.port", 9600, lambda wire: None) == "/dev/ttyUSB1"
    with pytest.raises(BadInput, match="2 ports fit: /dev/ttyUSB0, /dev/ttyUSB1"):
        discovery.resolve_port("usb:0403:6001", "backend.nose.port", 9600, lambda wire: None)
    with pytest.raises(BadInput, match=r"backend\.arm\.port=usb:1A86:55D3.*no port fits.*usb:0403:6001:A1.*hardware\.ports"):
        discovery.resolve_port("usb:1A86:55D3", "backend.arm.port", 9600, lambda wire: None)


def test_a_port_that_is_not_there_is_refused_with_what_is(monkeypatch):
    plugged(monkeypatch, ("/dev/ttyUSB0", 0x0403, 0x6001, "A1"))
    with pytest.raises(BadInput, match=r"no such port.*ttyUSB0 \(usb:0403:6001:A1\)"):
        discovery.resolve_port("/dev/ttyUSB7", "backend.nose.port", 9600, lambda wire: None)


def test_ask_takes_the_port_that_answers(monkeypatch, pty):
    deaf, (master, slave) = pty(), pty()
    plugged(monkeypatch, (deaf[1], 1, 1, "x"), (slave, 1, 1, "y"))
    echo = threading.Thread(target=lambda: os.write(master, os.read(master, 10)))
    echo.start()

    def identify(wire):
        wire.write(b"who?")
        return wire.read(0.3).decode() or None

    assert discovery.resolve_port("ask", "backend.nose.port", 115200, identify) == slave
    echo.join()


@pytest.fixture
def pty():
    """Makes pairs (master fd, path of the slave)."""
    held = []

    def made():
        master, slave = os.openpty()
        tty.setraw(slave)
        held.extend([master, slave])
        return master, os.ttyname(slave)

    yield made
    for fd in held:
        with contextlib.suppress(OSError):
            os.close(fd)


def test_a_port_is_opened_by_one_program_alone(pty):
    _, path = pty()
    first = open_port(path, 115200, "backend.nose.port")
    with pytest.raises(BadInput, match="another program has it open"):
        open_port(path, 115200, "backend.nose.port")
    first.close()
    open_port(path, 115200, "backend.nose.port").close()


def test_nor_can_a_program_open_it_that_asks_for_no_lock(pty):
    """As most do. Root may; so the flag is asked for where the tests run as root."""
    _, path = pty()
    wire = open_port(path, 115200, "backend.nose.port")
    held = fcntl.ioctl(wire._fd, TIOCGEXCL, b"\0" * 4)
    assert int.from_bytes(held, "little") == 1
    if os.geteuid() != 0:
        with pytest.raises(OSError, match="busy"):
            os.open(path, os.O_RDWR | os.O_NOCTTY)
    wire.close()


def test_to_close_a_port_twice_leaves_others_exclusive(pty):
    """Its number may be another's by then."""
    wire = open_port(pty()[1], 115200, "backend.nose.port")
    wire.close()
    other = open_port(pty()[1], 115200, "backend.arm.port")
    wire._fd = other._fd
    wire.close()
    assert int.from_bytes(fcntl.ioctl(other._fd, TIOCGEXCL, b"\0" * 4), "little") == 1
    other.close()


def test_a_port_that_is_torn_out_is_unplugged_and_not_an_exception_of_the_system(pty):
    master, path = pty()
    wire = open_port(path, 115200, "backend.nose.port")
    os.write(master, b"abc")
    assert wire.read(0.5) == b"abc" and wire.read(0.0) == b""
    os.close(master)
    with pytest.raises(Unplugged):
        for _ in range(100):
            wire.write(b"x")
            wire.read(0.01)
    wire.close()
    wire.close()


def test_what_came_in_before_the_question_is_no_answer(pty):
    master, path = pty()
    wire, lines = open_port(path, 115200, "backend.nose.port"), Lines()
    os.write(master, sentence("ACK", "OLD"))
    time.sleep(0.05)
    with pytest.raises(NoAnswer):
        request(wire, b"x", lines, lambda fields: True, 0.1)
    threading.Timer(0.5, lambda: os.write(master, sentence("NOSE", "1") + sentence("ACK", "NEW"))).start()
    assert request(wire, b"x", lines, lambda fields: fields[0] == "ACK", 5.0) == ("ACK", "NEW")
    wire.close()


def test_a_late_answer_to_what_is_asked_again_will_do(pty):
    """Every answer comes when the next question has been asked: none is ever in time."""
    master, path = pty()
    wire, over = open_port(path, 115200, "backend.nose.port"), threading.Event()

    def slow():
        while not over.is_set():
            if select.select([master], [], [], 0.05)[0] and os.read(master, 100):
                time.sleep(0.3)
                os.write(master, sentence("ACK", "ID"))

    thread = threading.Thread(target=slow)
    thread.start()
    try:
        assert request_until(wire, b"x", Lines(), lambda fields: fields[0] == "ACK", 0.2, 5.0) == ("ACK", "ID")
        with pytest.raises(NoAnswer):
            request_until(wire, b"x", Lines(), lambda fields: fields[0] == "NAK", 0.2, 0.3)
    finally:
        over.set()
        thread.join()
        wire.close()


def test_a_clock_says_how_long_the_host_was_suspended(monkeypatch):
    monkeypatch.setattr("hardware.transport.clock.suspended_ns", lambda: 7 * SECOND_NS)
    clock = Clock(4.0)
    assert clock.suspended_s == 0.0
    monkeypatch.setattr("hardware.transport.clock.suspended_ns", lambda: 10 * SECOND_NS)
    assert clock.suspended_s == 3.0


def test_this_host_tells_how_long_it_was_suspended():
    assert suspended_ns() > -SECOND_NS // 1000 and abs(Clock(1.0).suspended_s) < 0.1  # two clocks, read one after the other


# ---- devices


class Echo:
    """A driver that asks its device for a byte each turn."""

    key, name, baud = "backend.nose", "echo", 115200

    def __init__(self):
        self.begun, self.heard, self.ended = 0, 0, 0

    def identify(self, wire):
        return None

    def configure(self, wire):
        self.begun += 1

    def poll(self, wire):
        wire.write(b"?")
        data = wire.read(0.05)
        self.heard += len(data)
        return bool(data)

    def release(self, wire):
        self.ended += 1

    def counts(self):
        return Counter(heard=self.heard)


class Answering(threading.Thread):
    """The device: a pty at a link, which can be torn out and plugged in again."""

    def __init__(self, link):
        super().__init__(daemon=True)
        self.link, self.fd, self.deaf, self.over = link, -1, False, False
        self.plug()

    def plug(self):
        master, slave = os.openpty()
        tty.setraw(slave)
        os.symlink(os.ttyname(slave), self.link)
        os.set_blocking(master, False)
        self.slave, self.fd = slave, master

    def unplug(self):
        fd, self.fd = self.fd, -1
        os.unlink(self.link)
        time.sleep(0.02)
        os.close(fd)
        os.close(self.slave)

    def run(self):
        while not self.over:
            try:
                if self.fd >= 0 and os.read(self.fd, 100) and not self.deaf:
                    os.write(self.fd, b"!")
            except OSError:
                pass
            time.sleep(0.002)


def echo_device(port):
    driver = Echo()
    return Device(SerialOpener(port, driver), driver, Mailbox(10), Clock(1.0), TIMEOUTS)


@pytest.fixture
def bench(tmp_path):
    """A running echo device and its thread."""
    there = Answering(str(tmp_path / "nose"))
    there.start()
    device = echo_device(str(tmp_path / "nose"))
    device.start()
    assert device.ready.wait(2.0)
    yield there, device
    device.stop()
    there.over = True
    there.join()


def until(what, within_s=3.0):
    end = time.monotonic() + within_s
    while not what() and time.monotonic() < end:
        time.sleep(0.01)
    assert what()


def test_a_device_that_is_unplugged_and_plugged_in_again_goes_on(bench):
    there, device = bench
    until(lambda: device.driver.heard > 3)
    there.unplug()
    time.sleep(0.3)
    heard = device.driver.heard
    there.plug()
    until(lambda: device.driver.heard > heard + 3)
    assert device.driver.begun == 2 and device.reconnects == 1 and device.error is None and device.news[0][0] == "gap"


def test_a_device_that_falls_silent_is_opened_anew(bench):
    there, device = bench
    until(lambda: device.driver.heard > 3)
    there.deaf = True
    until(lambda: device.driver.begun > 1)
    there.deaf = False
    heard = device.driver.heard
    until(lambda: device.driver.heard > heard)
    assert device.error is None


def test_a_device_that_says_nothing_however_often_it_is_opened_ends_too(bench):
    there, device = bench
    until(lambda: device.driver.heard > 3)
    there.deaf = True
    until(lambda: device.error is not None, 8.0)
    assert "did not answer for 2 s (silent)" in str(device.error) and device.reconnects >= 2


def test_how_long_it_was_away_is_told(bench):
    there, device = bench
    until(lambda: device.driver.heard > 3)
    there.unplug()
    time.sleep(0.5)
    there.plug()
    until(lambda: len(device.news) > 1)
    back = re.fullmatch(r"backend\.nose echo: back after (\d\.\d) s", device.news[1][1])
    assert 0.4 <= float(back[1]) <= 2.0 and device.away_ns >= 0.5 * SECOND_NS


def test_a_device_that_stays_away_ends_with_a_clear_word(bench):
    there, device = bench
    there.unplug()
    until(lambda: device.error is not None, 5.0)
    assert isinstance(device.error, OioError)
    for word in ("backend.nose.driver=echo", "2 s", "hardware.ports"):
        assert word in str(device.error)
    assert not device.is_alive() or device.join() is None


def test_leaving_says_goodbye_and_lets_the_port_go(bench, tmp_path):
    _, device = bench
    device.stop()
    assert device.driver.ended == 1 and not device.is_alive()
    open_port(str(tmp_path / "nose"), 115200, "backend.nose.port").close()


def test_a_device_that_was_never_started_can_be_left(tmp_path):
    device = echo_device(str(tmp_path / "nothing"))
    device.stop()
    assert device.error is None and device.driver.ended == 0


def test_a_port_that_never_was_is_refused_at_once(tmp_path):
    device = echo_device(str(tmp_path / "nothing"))
    device.start()
    assert device.ready.wait(1.0) and isinstance(device.error, BadInput)
    device.stop()
