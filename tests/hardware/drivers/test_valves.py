"""Who opens the gas: relays that boot, go away and come back, and a person who is asked."""

import os
import sys
import threading
import time
from pathlib import Path

import pytest

from hardware.drivers.valves.port import ValvePort
from hardware.drivers.valves.valve_driver import HEARTBEAT_S, NO_ANSWER_S
from hardware.emulators import options
from hardware.emulators.emulated_bench import emulate_bench
from hardware.emulators.line import HOLD_S
from hardware.transport.driver import Timeouts
from oio.core import interrupt
from oio.core.errors import BadInput, OioError

KEYS = Path(__file__).resolve().parents[3] / "conf" / "emulate.yaml"
TIMEOUTS = Timeouts(connect_s=3.0, receive_s=1.0, reconnect_s=4.0, backoff_s=0.1, backoff_max_s=1.0)
HASTY = Timeouts(connect_s=0.1, receive_s=0.1, reconnect_s=0.5, backoff_s=0.1, backoff_max_s=0.1)


@pytest.fixture
def bench(built, tmp_path):
    """Running, with a valve; `bench.gas` is what the valve let out, in order."""
    words = {"nose": "scd30", "arm": "none", "speed": "4", "out": str(tmp_path)}
    chosen, overrides = options.read([f"{key}={value}" for key, value in words.items()], KEYS)
    with emulate_bench(chosen, built("backend", "air=steady", "dof=3", *overrides)) as made:
        device, gas = made.loop._served["valve"]._device, []
        let_out = device._present
        device._present = lambda source: (gas.append(source), let_out(source))
        with made.loop.running():
            yield made, gas


def test_relays_boot_are_told_and_let_out_nothing_at_the_end(bench):
    made, gas = bench
    with ValvePort(driver="line", port=str(made.ports["valve"])).open(TIMEOUTS) as valve:
        assert gas == ["none"]  # the opening has reset it
        valve.present("beacon", interrupt.check)
        valve.present("source", interrupt.check)
        assert gas == ["none", "beacon", "source"]
    assert gas[-1] == "none"


def passed(made, for_s):
    """So many seconds of the bench, which may be slow."""
    until_s, patience_s = made.loop.realtime.tick_s + for_s, time.monotonic() + 60.0
    while made.loop.realtime.tick_s < until_s:
        assert time.monotonic() < patience_s
        time.sleep(0.02)


def said(valve):
    """Its next news."""
    until_s = time.monotonic() + TIMEOUTS.reconnect_s
    while (news := valve.poll()) is None and time.monotonic() < until_s:
        time.sleep(0.02)
    return news


def test_gas_stays_open_while_the_host_lives_and_closes_when_it_dies(bench):
    made, gas = bench
    with ValvePort(driver="line", port=str(made.ports["valve"])).open(TIMEOUTS) as valve:
        valve.present("beacon", interrupt.check)
        passed(made, 2.0 * HOLD_S)
        assert gas == ["none", "beacon"] and valve.poll() is None
        valve._stop_requested.set()  # what SIGKILL does, too: no more beats, no goodbye, and a port that is let go
        valve._heartbeat_thread.join()
        valve._close_port()
        passed(made, 1.1 * HOLD_S)
        assert gas == ["none", "beacon", "none"]


def test_a_beat_waits_for_a_present_that_waits(bench, monkeypatch):
    made, gas = bench
    with ValvePort(driver="line", port=str(made.ports["valve"])).open(TIMEOUTS) as valve:
        valve.present("beacon", interrupt.check)
        beats, beat = [], valve._heartbeat
        monkeypatch.setattr(valve, "_heartbeat", lambda: (beats.append(valve._command), beat()))
        with valve._lock:
            time.sleep(1.5 * HEARTBEAT_S)
            assert beats == []
        valve.present("none", interrupt.check)
        time.sleep(2.5 * HEARTBEAT_S)
        assert set(beats) == {"V0"} and gas == ["none", "beacon", "none"]


def test_what_kills_the_thread_is_raised(bench, monkeypatch):
    made, gas = bench
    with ValvePort(driver="line", port=str(made.ports["valve"])).open(TIMEOUTS) as valve:
        valve.present("source", interrupt.check)
        monkeypatch.setattr(valve, "_heartbeat", lambda: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            said(valve)
        with pytest.raises(ZeroDivisionError):
            valve.poll()
    assert gas[-1] == "none"


def unplugged(made):
    """Its valve, until `plugged`."""
    made.loop._first_request_s, made.loop._schedule = 0.0, [options.Fault("valve", "unplug", 0.0, 1e9)]
    while made.loop._served["valve"].port.plugged:
        time.sleep(0.01)


def plugged(made):
    made.loop._schedule = ()


def test_relays_that_are_away_are_told_when_they_are_back(bench):
    made, gas = bench
    with ValvePort(driver="line", port=str(made.ports["valve"])).open(TIMEOUTS) as valve:
        unplugged(made)
        back = threading.Timer(1.0, plugged, (made,))
        back.start()
        valve.present("source", interrupt.check)
        assert gas[-1] == "source"
        back.join()


def test_relays_that_go_away_meanwhile_are_told_again_without_waiting(bench):
    made, gas = bench
    with ValvePort(driver="line", port=str(made.ports["valve"])).open(TIMEOUTS) as valve:
        valve.present("beacon", interrupt.check)
        assert valve.poll() is None
        unplugged(made)
        assert said(valve) == "backend.valve line: its port went away" and valve.poll() is None
        plugged(made)
        assert said(valve) == "backend.valve line: did V1 again" and gas[-3:] == ["none", "none", "beacon"]  # plugged in, opened, told
        assert valve.poll() is None


def test_relays_that_fall_silent_on_an_open_port_are_noticed_and_told_again(bench):
    """A write succeeds as long as the USB chip takes it, whatever the board behind it does."""
    made, gas = bench
    with ValvePort(driver="line", port=str(made.ports["valve"])).open(TIMEOUTS) as valve:
        valve.present("beacon", interrupt.check)
        made.loop._first_request_s, made.loop._schedule = 0.0, [options.Fault("valve", "busy", 0.0, 1e9)]
        until_s = time.monotonic() + 3.0 * NO_ANSWER_S
        while (news := valve.poll()) is None and time.monotonic() < until_s:
            time.sleep(0.02)
        assert news == "backend.valve line: does not answer"
        made.loop._schedule = ()
        assert said(valve) == "backend.valve line: did V1 again" and gas[-1] == "beacon"


def test_relays_that_stay_away_are_missed_with_one_sentence(bench):
    made, _ = bench
    with ValvePort(driver="line", port=str(made.ports["valve"])).open(TIMEOUTS) as valve:
        valve.present("source", interrupt.check)
        unplugged(made)
        valve._timeouts = HASTY
        with pytest.raises(OioError, match=r"backend\.valve\.port=.* does not say that it did V1 .*Check its cable"):
            valve.present("beacon", interrupt.check)
        assert said(valve) == "backend.valve line: its port went away"
        time.sleep(1.1 * HASTY.reconnect_s)
        with pytest.raises(OioError, match="stays away"):
            valve.poll()


def test_a_stop_ends_the_waiting_for_relays(bench, monkeypatch):
    made, gas = bench
    with ValvePort(driver="line", port=str(made.ports["valve"])).open(TIMEOUTS) as valve:
        valve.present("source", interrupt.check)
        monkeypatch.setattr(interrupt, "_asked", [2])
        with pytest.raises(KeyboardInterrupt):
            valve.present("beacon", interrupt.check)
        time.sleep(1.5 * HEARTBEAT_S)
        assert "beacon" not in gas  # what was stopped is not told by the next beat either
    assert gas[-1] == "none"  # it is closed nevertheless


def test_relays_that_are_not_there_or_are_something_else_are_refused(bench, tmp_path):
    made, _ = bench
    with pytest.raises(BadInput, match="no such port"), ValvePort(driver="line", port=str(tmp_path / "no")).open(TIMEOUTS):
        pass
    with pytest.raises(OioError, match="says nothing"), ValvePort(driver="line", port=str(made.ports["nose"])).open(HASTY):
        pass


def test_a_person_is_asked_and_reminded_to_close_the_gas(monkeypatch, capsys):
    read, write = os.pipe()
    with os.fdopen(read) as person:
        monkeypatch.setattr(sys, "stdin", person)
        with ValvePort(driver="ask", port=None).open(TIMEOUTS) as valve:
            os.write(write, b"\n")
            valve.present("source", interrupt.check)
            assert "open the source to be found, then press Enter" in capsys.readouterr().err
            os.close(write)
            with pytest.raises(OioError, match="nobody is there"):
                valve.present("beacon", interrupt.check)
            capsys.readouterr()
        assert capsys.readouterr().err == "oio: please close every gas source.\n"


def test_who_waits_for_a_person_hears_of_the_bench(monkeypatch):
    read, write = os.pipe()

    def held():
        raise OioError("the arm was stopped: it met something")

    with os.fdopen(read) as person:
        monkeypatch.setattr(sys, "stdin", person)
        with ValvePort(driver="ask", port=None).open(TIMEOUTS) as valve, pytest.raises(OioError, match="met something"):
            valve.present("beacon", held)
        os.close(write)


def test_nobody_says_nothing(capsys):
    with ValvePort(driver="none", port=None).open(TIMEOUTS) as valve:
        valve.present("source", interrupt.check)
    assert capsys.readouterr() == ("", "")


def test_a_host_that_was_suspended_leaves_the_gas_closed(bench, monkeypatch):
    made, gas = bench
    slept_ns = [0]
    monkeypatch.setattr("hardware.drivers.valves.valve_driver.suspended_ns", lambda: slept_ns[0])
    with ValvePort(driver="line", port=str(made.ports["valve"])).open(TIMEOUTS) as valve:
        valve.present("source", interrupt.check)
        slept_ns[0] = 3600 * 10**9
        until_s = time.monotonic() + 5.0
        with pytest.raises(OioError, match=r"suspended or too busy for 360. s"):
            while time.monotonic() < until_s:
                time.sleep(0.05)
                valve.poll()
    assert gas[-1] == "none"
