"""The terminal: its width, and whether its characters are UTF-8."""

import locale
import shutil
import sys
from typing import Annotated

from oio.core.settings import Within, settings
from oio.doctor.finding import PASS, WARN, Finding


@settings
class Terminal:
    """Columns that the table of a run takes."""

    columns: Annotated[int, Within(1, 1000)]

    def check(self) -> Finding:
        """WARN for another encoding, and for a terminal in which tables break."""
        columns = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
        return self.judge(sys.stdout.encoding or "", locale.getpreferredencoding(False), columns)

    def judge(self, encoding: str, files: str, columns: int | None) -> Finding:
        """Judge the encodings of the terminal and of files, and the terminal's columns (None: the output is no terminal)."""
        if not all(_is_utf8(name) for name in (encoding, files)):
            found = f"characters are {encoding or 'unknown'}, those of files {files}"
            return Finding("terminal", WARN, found, "Type export LANG=C.UTF-8: tables are drawn with lines that ASCII lacks.")
        if columns is not None and columns < self.columns:
            found = f"UTF-8, {columns} columns"
            return Finding("terminal", WARN, found, f"Widen it to {self.columns} columns: the table of a run breaks its lines otherwise.")
        return Finding("terminal", PASS, f"UTF-8, {'no terminal' if columns is None else f'{columns} columns'}")


def _is_utf8(encoding: str) -> bool:
    return encoding.lower().replace("-", "").replace("_", "") == "utf8"
