"""The Rerun viewer: a window of its own, one that runs elsewhere, or a file that it reads."""

import importlib.util
import os
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from oio.core.errors import BadInput
from oio.core.settings import settings
from oio.view.rerun_recording import new_recording
from oio.view.rerun_stream import RerunStream

ANSWER_S = 5.0  # a viewer that does not answer in this time is taken for gone
CLOSING_S = 30.0  # a viewer that has not taken all in this time after the end is left
PORTS = {"rerun": 443, "rerun+https": 443, "rerun+http": 80}  # of addresses that name none
INSTALL = "The Rerun viewer needs the package rerun-sdk, which is not installed. Type: pip install 'oio[view]'"


@settings
class RerunView:
    """Where the stream goes: to a viewer at `address`, into `file`, or, with neither, to a window that is opened."""

    address: str | None  # of a running viewer, e.g. rerun+http://127.0.0.1:9876/proxy
    file: str | None  # .rrd

    def check(self) -> None:
        """Refuse what cannot be shown, before anything runs."""
        if self.address is not None and self.file is not None:
            raise BadInput(f"address {self.address} and file {self.file} were both given, but a stream goes to one of them. Leave one out.")
        if self.address is not None and self.address.partition("://")[0] not in PORTS:
            raise BadInput(
                f"{self.address} was given as the address of a Rerun viewer, but that begins with rerun://, rerun+http:// or "
                f"rerun+https://. Give e.g. rerun+http://127.0.0.1:9876/proxy."
            )
        if self.file is not None and Path(self.file).suffix != ".rrd":
            raise BadInput(f"{self.file} was given as the file for the Rerun viewer, but its name ends in .rrd. Give e.g. run.rrd.")

    @contextmanager
    def open(self) -> Iterator[RerunStream]:
        """Begin the stream; it is complete when the context ends. Raises BadInput without package, display, or place for the file."""
        if importlib.util.find_spec("rerun") is None:
            raise BadInput(INSTALL)
        if self.file is not None:
            _refuse_taken(Path(self.file))
        elif self.address is None and not _has_display():
            raise BadInput(
                "The Rerun viewer is a window, but there is no display here. Write a file (view.file=run.rrd; python -m oio.view: --save "
                "run.rrd), or send it to a viewer that runs elsewhere (view.address=URL; --address URL)."
            )
        if self.address is not None:
            _refuse_silent(self.address)
        recording = new_recording(self.address, self.file)
        stream = RerunStream(recording)
        try:
            yield stream
        finally:
            stream.flush()
            _close(recording)


def _refuse_silent(address: str) -> None:
    where = urlsplit(address)
    try:
        port = where.port or PORTS[where.scheme]
        socket.create_connection((where.hostname or "", port), timeout=ANSWER_S).close()
    except (OSError, ValueError):  # the SDK would say so at the end of a run
        raise BadInput(f"no Rerun viewer answers at {address}. Start one there: rerun --port 9876") from None


def _close(recording: Any) -> None:
    """End the stream; a viewer that was closed meanwhile, or that hangs, is no failure of what it showed."""
    import rerun

    failures = list[RuntimeError]()

    def end() -> None:
        try:
            recording.flush(timeout_sec=ANSWER_S)
        except RuntimeError as error:
            failures.append(error)
        recording.disconnect()  # waits for a viewer that hangs as long as it does

    ending = threading.Thread(target=end, daemon=True)
    ending.start()
    ending.join(CLOSING_S)
    if ending.is_alive():
        rerun.unregister_shutdown()  # so would the end of the process
        sys.stderr.write(f"the Rerun viewer did not take all within {CLOSING_S:g} s\n")
    for failure in failures:
        sys.stderr.write(f"the Rerun viewer did not take all: {failure}\n")


def _refuse_taken(path: Path) -> None:
    if path.exists():
        raise BadInput(f"{path} is there already, and a file is never overwritten. Give another name, e.g. {path.stem}_2.rrd.")
    folder = path.absolute().parent
    if not folder.is_dir():
        raise BadInput(f"{path} was given as the file for the Rerun viewer, but there is no such folder. Make it first: mkdir -p {folder}")


def _has_display() -> bool:
    return sys.platform in ("darwin", "win32") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
