"""A viewer that hangs, or is killed, while it is shown something: the run goes on, and ends, and says so."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("rerun")

ROOT = Path(__file__).resolve().parents[3]
SHOWN = """
import os, signal, sys
import oio.view.rerun_view as view
from oio.core.records import GasReading
view.ANSWER_S = view.CLOSING_S = 1.0
with view.RerunView(address=sys.argv[1], file=None).open() as watcher:
    watcher(GasReading(0, 0, 1.0, 0.1))
    os.killpg(int(sys.argv[2]), getattr(signal, sys.argv[3]))
    for t_ns in range(3000):
        watcher(GasReading(t_ns, 0, 1.0, 0.1))
print("ended")
"""


@pytest.fixture
def viewer():
    """(address, process group) of a viewer without a window."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "rerun", "--serve-grpc", "--bind", "127.0.0.1", "--port", str(port)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    while True:
        try:
            socket.create_connection(("127.0.0.1", port)).close()
            break
        except OSError:
            assert process.poll() is None
            time.sleep(0.1)
    yield f"rerun+http://127.0.0.1:{port}/proxy", process.pid
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@pytest.mark.parametrize("fate", ["SIGSTOP", "SIGKILL"])
def test_what_is_shown_ends_without_its_viewer(viewer, fate):
    address, group = viewer
    command = [sys.executable, "-c", SHOWN, address, str(group), fate]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "ended\n" and "Traceback" not in done.stderr
    if fate == "SIGSTOP":  # of a viewer that is gone the SDK tells by itself, sooner or later
        assert "the Rerun viewer did not take all" in done.stderr
