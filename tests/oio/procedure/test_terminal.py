"""A person at a terminal: a pty that types. A wrong answer is asked again; Ctrl-C and an end of input end the run as elsewhere."""

import json
import os
import pty
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[3]
WORDS = ("protocol=emulated", "sensor=ndir", "dof=1", "stage=[warm_up,baseline]")
TYPED = {
    "Who operates": "\r",
    "text is allowed, in quotes": "Ada\r",
    "serial number": "0012\r",
    "Close every gas": "\r",
    "temperature": "warm\r",
    "'warm' was given, but a number from 0 to 50 degC is allowed": "21.5\r",
    "stay as it was": "y\r",
}


class Person:
    """A run at a terminal, and a person who reads and types."""

    def __init__(self, out):
        self._own, self._terminal = pty.openpty()
        command = [sys.executable, "-m", "oio.run", *WORDS, "report=false", f"hydra.run.dir={out}"]
        self.process = subprocess.Popen(command, cwd=ROOT, stdin=self._terminal, stdout=self._terminal, stderr=self._terminal)
        os.close(self._terminal)
        self.seen = ""

    def reads(self, text, within_s=60.0):
        """Read until the text appears in what was not yet read."""
        end_s, fresh = time.monotonic() + within_s, ""
        while text not in fresh and time.monotonic() < end_s:
            if not select.select([self._own], [], [], 0.5)[0]:
                continue
            try:
                fresh += os.read(self._own, 4096).decode(errors="replace")
            except OSError:  # the other end is closed
                break
        self.seen += fresh
        return text in fresh

    def types(self, text):
        os.write(self._own, text.encode())

    def leaves(self):
        """Wait for the end of the run; returns its exit code."""
        self.reads("\0", within_s=0.5 if self.process.poll() is None else 0.1)
        code = self.process.wait(timeout=60)
        os.close(self._own)
        return code


@pytest.fixture
def person(tmp_path):
    someone = Person(tmp_path / "run")
    yield someone
    someone.process.kill()


def test_every_step_is_asked_and_a_wrong_answer_is_asked_again(person, tmp_path):
    for question, typed in TYPED.items():
        assert person.reads(question), person.seen
        person.types(typed)
    assert person.reads("log, calibration and numbers are in"), person.seen
    assert person.leaves() == 0
    assert "1 s left" in person.seen and "over." in person.seen and "Traceback" not in person.seen
    protocol = json.loads((tmp_path / "run" / "summary.json").read_text())["protocol"]
    assert protocol["answers"] == {
        "operator": "Ada", "sensor_serial": "0012", "gas_closed": "done", "room_degc": 21.5, "undisturbed": True,
    }  # fmt: skip


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_while_a_prompt_waits_ends_with_code_130(person, tmp_path, stop):
    assert person.reads("Who operates"), person.seen
    person.process.send_signal(stop)  # SIGINT is what a terminal makes of Ctrl-C
    assert person.reads("oio: stopped; what was logged so far can be read"), person.seen
    assert person.leaves() == 130 and "Traceback" not in person.seen
    assert json.loads((tmp_path / "run" / "status.json").read_text())["state"] == "interrupted"


def test_an_end_of_input_says_how_to_run_unattended(person):
    assert person.reads("Who operates"), person.seen
    person.types("\x04")
    assert person.reads("nobody is there to answer 'operator'"), person.seen
    assert person.leaves() == 1 and "protocol.answers=FILE" in person.seen and "Traceback" not in person.seen
