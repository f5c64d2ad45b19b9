"""The compiled firmware on a simulated ATmega328P (simavr) says and does what its protocol says. Times are those of its own crystal."""

import contextlib
import os
import re
import select
import subprocess
import threading
import time
import tty
from collections import Counter
from collections.abc import Callable, Iterator
from functools import reduce
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hardware.codecs.line import Commands, Lines

pytestmark = pytest.mark.long

SPEED = 3.0  # times real time, if the machine is free; nothing depends on it
PATIENCE_S = 120.0  # for a busy machine
HOLD_MS = 10_000  # of valve.h
LSB_MV = 5000 / 1023
IDENTITY = ("ACK", "ID", "OIO-NOSE", "1", "10")
Fields = tuple[str, ...]


class Board:
    """A running board: `sentences` are all it said so far, `lines_us` when each ended, `valves` its two pins and when they changed."""

    def __init__(self, host: Path, elf: Path, speed: float = SPEED) -> None:
        self._process = subprocess.Popen([host, elf, str(speed)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.sentences: list[Fields] = []
        self.broken: list[bytes] = []
        self.found: list[Fields] = []
        self.codec = Lines()  # ours; what it finds is what the protocol read to the letter finds
        self.lines_us: list[int] = []
        self.valves: list[tuple[int, int, int]] = []
        self.path = self._told()[0]
        self._fd = os.open(self.path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._fd)
        self._leave = threading.Event()
        self._threads = [threading.Thread(target=f, daemon=True) for f in (self._listen, self._watch)]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """End it; it must not have crashed."""
        self._leave.set()
        assert self._process.stdin and self._process.stdout
        self._process.stdin.close()
        try:
            assert self._process.wait(PATIENCE_S) == 0
        finally:
            self._process.kill()
            for thread in self._threads:
                thread.join()
            os.close(self._fd)
            self._process.stdout.close()

    def _told(self) -> list[str]:
        assert self._process.stdout
        return self._process.stdout.readline().split()[1:]

    def _listen(self) -> None:
        rest = b""
        while not self._leave.is_set():
            if select.select([self._fd], [], [], 0.05)[0]:
                data = os.read(self._fd, 4096)
                *lines, rest = (rest + data).split(b"\n")
                self.found += self.codec.feed(data)
                for line in lines:
                    self._hear(line + b"\n")

    def _hear(self, line: bytes) -> None:
        match = re.fullmatch(rb"\$([ -#%-)+-~]*)\*([0-9A-F]{2})\r\n", line)
        if match and reduce(int.__xor__, match[1], 0) == int(match[2], 16):
            self.sentences.append(tuple(match[1].decode().split(",")))
        else:
            self.broken.append(line)

    def _watch(self) -> None:
        assert self._process.stdout
        for line in self._process.stdout:
            kind, *numbers = line.split()
            if kind == "valve":
                self.valves.append((int(numbers[0]), int(numbers[1]), int(numbers[2])))
            else:
                self.lines_us.append(int(numbers[0]))

    def millivolts(self, a: int, b: int, ripple: int = 0) -> None:
        """Put so much on ADC0 and ADC1."""
        assert self._process.stdin
        self._process.stdin.write(f"{a} {b} {ripple}\n")
        self._process.stdin.flush()

    def say(self, data: bytes) -> int:
        """To its serial line; returns how many sentences it had said before."""
        before = len(self.sentences)
        while data:
            data = data[os.write(self._fd, data) :]
        return before

    def heard(self, since: int, fits: Callable[[Fields], bool], count: int = 1) -> list[Fields]:
        """The first `count` sentences after the first `since` that fit."""
        self.until(lambda: sum(map(fits, self.sentences[since:])) >= count)
        return [s for s in self.sentences[since:] if fits(s)][:count]

    def until(self, so: Callable[[], bool]) -> None:
        """Wait for it."""
        until_s = time.monotonic() + PATIENCE_S
        while not so():
            assert time.monotonic() < until_s, f"waited in vain; the last it said: {self.sentences[-3:]}, broken: {self.broken[-3:]}"
            time.sleep(0.005)

    def answer(self, command: str | bytes) -> Fields:
        """What it answers to one command."""
        data = command.encode() if isinstance(command, str) else command
        return self.heard(self.say(data + b"\n"), lambda s: s[0] in ("ACK", "NAK"))[0]

    def frames(self, count: int) -> list[Fields]:
        """The next so many reports that begin from now on."""
        self.answer("P20")  # a report that was under way comes before this answer
        return self.heard(len(self.sentences), is_report, count)


def is_report(sentence: Fields) -> bool:
    return sentence[0] == "NOSE"


@contextlib.contextmanager
def powered(host: Path, elf: Path) -> Iterator[Board]:
    board = Board(host, elf)
    try:
        board.until(lambda: bool(board.sentences))  # what is said to it before it has booted is lost
        yield board
    finally:
        board.close()


@pytest.fixture(scope="module")
def board(host: Path, elf: Path) -> Iterator[Board]:
    """One for all tests that can share it; whatever they do, it says no broken sentence, and our codec finds every one."""
    with powered(host, elf) as board:
        yield board
    assert board.broken == [] and board.found == board.sentences
    assert board.codec.corrupt == board.codec.skipped == 0


def test_it_is_small(elf: Path) -> None:
    text, data = map(int, subprocess.run(["avr-size", elf], check=True, capture_output=True, text=True).stdout.splitlines()[1].split()[:2])
    assert 0 < text + data < 8192


def test_the_watchdog_is_stopped_before_memory_is_set_up(elf: Path) -> None:
    lines = subprocess.run(["avr-nm", elf], check=True, capture_output=True, text=True).stdout.splitlines()
    at = {name: int(address, 16) for address, _, name in map(str.split, lines)}
    assert 0 < at["watchdog_off"] < at["__do_copy_data"]  # after a reset by the watchdog there are 16 ms to do so


def test_it_says_who_it_is(board: Board) -> None:
    assert board.answer("ID") == IDENTITY


def understood(text: str) -> bool:
    """Whether the protocol has such a command."""
    period = re.fullmatch("P([0-9]+)", text)
    return text in ("ID", "SA", "SB", "V0", "V1", "V2") or bool(period and 20 <= int(period[1]) <= 10000)


commands = st.one_of(
    st.sampled_from([b"ID", b"SA", b"SB", b"V0", b"V1", b"V2", b"P20", b"P10000"]),
    st.integers(0, 1 << 40).map(lambda ms: f"P{ms}".encode()),
    st.text("SABVIDP012W,*$ \r", max_size=20).map(str.encode),
    st.binary(max_size=200).map(lambda data: data.replace(b"\n", b"?")),
)


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(commands)
def test_every_line_has_one_answer_and_the_next_is_understood(board: Board, command: bytes) -> None:
    codec = Commands()
    texts = codec.feed(command + b"\n")
    *answers, last = board.heard(board.say(command + b"\nID\n"), lambda s: not is_report(s), len(texts) + 1)
    assert last == IDENTITY
    for text, answer in zip(texts, answers, strict=True):  # one, or none to an empty line
        if codec.good and text == "ID":
            assert answer == IDENTITY
        elif codec.good and understood(text):
            assert answer[:2] == ("ACK", text) and int(answer[2]) >= 0 and len(answer) == 3
        else:
            assert answer == ("NAK", text)


@pytest.mark.parametrize(
    "command", ["P", "P19", "P10001", "P65556", "P4294967316", "P-20", "P20.0", "SC", "S", "SAA", "V3", "id", "P0000000000001000"]
)
def test_what_is_no_command_is_said_back(board: Board, command: str) -> None:
    said = command if len(command) <= 16 else command[:15] + "?"
    assert board.answer(command) == ("NAK", said)


def test_the_element_is_the_one_last_selected(board: Board) -> None:
    for element in "BBABA":
        board.answer(f"S{element}")
        assert {f[2] for f in board.frames(2)} == {element}


@pytest.mark.parametrize(("period_ms", "count"), [(20, 50), (100, 20), (1000, 3)])
def test_the_period_is_kept(host: Path, elf: Path, period_ms: int, count: int) -> None:
    with powered(host, elf) as board:
        board.answer(f"P{period_ms}")
        since = len(board.sentences)
        board.heard(since, is_report, count)
    said = list(zip(board.sentences, board.lines_us, strict=False))[since : since + count]  # in step: nothing was lost
    device_ms = np.array([int(s[1]) for s, _ in said])
    crystal_ms = np.array([us for _, us in said]) / 1e3
    assert board.broken == []
    assert set(np.diff(device_ms)) == {period_ms}
    assert np.mean(np.diff(crystal_ms)) == pytest.approx(period_ms, rel=0.005)
    assert np.all(crystal_ms - device_ms < 10) and np.all(crystal_ms - device_ms > 0)  # out soon after it was stamped


def test_milliseconds_are_those_of_the_crystal(host: Path, elf: Path) -> None:
    with powered(host, elf) as board:
        said = board.heard(0, is_report, 30)
    late_ms = [us / 1e3 - int(s[1]) for s, us in zip(said, board.lines_us, strict=False)]
    assert np.ptp(late_ms) < 1.0
    assert int(said[0][1]) == 100  # they begin at boot


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 5000), st.integers(0, 5000), st.integers(0, 100))
def test_counts_are_those_of_the_millivolts(board: Board, a: int, b: int, ripple: int) -> None:
    board.millivolts(a, b, min(ripple, a, b, 5000 - a, 5000 - b))  # far more ripple than a count: the mean of conversions has none of it
    (frame,) = board.frames(1)
    assert [int(frame[3]), int(frame[4])] == pytest.approx([a / LSB_MV, b / LSB_MV], abs=1.1)


def test_the_whole_range_is_there(board: Board) -> None:
    for a, b, counts in [(0, 5000, ("0", "1023")), (5000, 0, ("1023", "0")), (6000, 2500, ("1023", "511"))]:
        board.millivolts(a, b)
        assert board.frames(1)[0][3:] == counts


def test_one_relay_at_most_is_on(board: Board) -> None:
    for command in ("V0", "V1", "V2", "V1", "V0"):
        assert board.answer(command)[:2] == ("ACK", command)
    board.until(lambda: [v[:2] for v in board.valves[-6:]] == [(1, 0), (0, 0), (0, 1), (0, 0), (1, 0), (0, 0)])
    assert all(not (beacon and source) for beacon, source, _ in board.valves)


def passed(board: Board, device_ms: int) -> None:
    """Wait until its clock says so."""
    board.heard(max(0, len(board.sentences) - 1), lambda s: is_report(s) and int(s[1]) >= device_ms)


def changes(board: Board) -> list[tuple[int, int]]:
    return [v[:2] for v in board.valves]


def test_gas_closes_by_itself_unless_it_is_asked_for_again(host: Path, elf: Path) -> None:
    with powered(host, elf) as board:
        first_ms = int(board.answer("V1")[2])
        passed(board, first_ms + 8000)
        last_ms = int(board.answer("V1")[2])
        passed(board, first_ms + 11_000)
        assert board.answer("V3")[0] == "NAK" and board.answer("ID") == IDENTITY  # which hold nothing
        board.until(lambda: len(board.valves) >= 2)
        assert changes(board) == [(1, 0), (0, 0)]  # the repetition did not click
        assert board.valves[-1][2] / 1e3 - last_ms == pytest.approx(HOLD_MS, abs=20)


def test_v0_stays_closed_and_a_change_holds_anew(host: Path, built_firmware: Callable[[str], Path]) -> None:
    with powered(host, built_firmware("-DVALVE_HOLD_MS=4000")) as board:
        first_ms = int(board.answer("V1")[2])
        passed(board, first_ms + 2500)
        last_ms = int(board.answer("V2")[2])
        passed(board, first_ms + 4200)
        assert changes(board) == [(1, 0), (0, 0), (0, 1)]
        board.answer("V0")
        passed(board, last_ms + 4200)
        assert changes(board) == [(1, 0), (0, 0), (0, 1), (0, 0)]


def test_relays_that_switch_on_a_low_level(host: Path, built_firmware: Callable[[str], Path]) -> None:
    with powered(host, built_firmware("-DRELAYS_LOW -DVALVE_HOLD_MS=4000")) as board:
        assert changes(board)[-1] == (1, 1)
        board.valves.clear()
        for command in ("V1", "V1", "V2", "V0", "V2"):
            last_ms = int(board.answer(command)[2])
        board.until(lambda: len(board.valves) >= 6)
        assert changes(board) == [(0, 1), (1, 1), (1, 0), (1, 1), (1, 0), (1, 1)]
        assert board.valves[-1][2] / 1e3 - last_ms == pytest.approx(4000, abs=20)


@pytest.mark.parametrize("flags", ["", "-DRELAYS_LOW"])
def test_relays_are_closed_before_their_pins_are_outputs(built_firmware: Callable[[str], Path], flags: str) -> None:
    """The simulated board does not tell a pulled-up input from an output, so the machine code is read: PORTD is 0x0b, DDRD 0x0a."""
    code = subprocess.run(["avr-objdump", "-d", built_firmware(flags)], check=True, capture_output=True, text=True).stdout
    body = code.split("<valve_begin>:\n")[1].split("\n\n")[0]
    written = re.findall(r"\b(?:r?call|(?:out|sbi|cbi)\s+0x0[ab])", body)
    kinds = ["direction" if "0x0a" in each else "level" for each in written]
    assert kinds == sorted(kinds, reverse=True) and set(kinds) == {"direction", "level"}


def test_a_flood_of_commands_neither_wedges_it_nor_holds_reports_up(host: Path, elf: Path) -> None:
    with powered(host, elf) as board:
        board.heard(0, is_report, 3)
        board.say(b"?\n" * 4000 + b"SA\xff" * 2000)  # 1.4 s
        board.heard(0, is_report, 18)
        assert board.answer("")[0] == "NAK"  # now the last of the flood has its end
        assert board.answer("SB")[:2] == ("ACK", "SB")
        reports = [int(s[1]) for s in board.sentences if is_report(s)]
    assert sum(s[0] == "NAK" for s in board.sentences) > 500
    assert board.broken == []
    assert max(np.diff(reports)) <= 120  # late by what it takes to make room for an answer


def test_what_is_lost_spoils_its_command(host: Path, elf: Path) -> None:
    with powered(host, elf) as board:
        board.say(b"P0000000000050\n" * 300)  # its answer is twice as long: half of it cannot be taken
        board.heard(0, is_report, 3)
        answers = [s for s in board.sentences if not is_report(s)]
    assert {s[:2] for s in answers if s[0] == "ACK"} == {("ACK", "P0000000000050")}  # never made of pieces of two
    counts = Counter(s[0] for s in answers)
    assert counts["NAK"] > 0 or counts["ACK"] > 200  # a busy host feeds it so slowly that nothing, or little, is lost


def test_a_loop_that_hangs_is_reset(host: Path, built_firmware: Callable[[str], Path]) -> None:
    with powered(host, built_firmware("-DWEDGE")) as board:
        for _ in range(2):  # the second time it starts with the watchdog's flag set
            for command in ("V2", "SB"):
                board.answer(command)
            before_ms = int(board.frames(20)[-1][1])
            hung = board.say(b"W\n")
            after = board.heard(hung, lambda s: is_report(s) and s[2] == "A", 3)
            assert [int(s[1]) for s in after] == [100, 200, 300] and before_ms > 300
            board.until(lambda: board.valves[-1][:2] == (0, 0))
            assert 0.9e6 < max(np.diff(board.lines_us)) < 1.3e6  # a second, and 100 ms to the first report
            board.lines_us.clear()  # of this hang
