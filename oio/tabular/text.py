"""Text of a table file: its bytes decoded, and everything refused that is no text."""

import codecs
import re
from collections.abc import Iterator
from dataclasses import dataclass

from oio.core.errors import BadInput

LOOKED_AT = 65536  # bytes by which the encoding of a whole file is judged
BOMS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
NO_TEXT = (
    (b"PK\x03\x04", "a ZIP archive or a spreadsheet (xlsx, ods)", "Save the sheet as CSV."),
    (b"\xd0\xcf\x11\xe0", "an old spreadsheet (xls)", "Save the sheet as CSV."),
    (b"\x1f\x8b", "a gzip archive without the ending .gz", "Name it FILE.csv.gz."),
    (b"\x89HDF", "an HDF5 file", "Export its table as CSV or Parquet."),
    (b"%PDF", "a PDF", "Ask its author for the CSV."),
)
LINE = re.compile(r"[^\r\n]+")


@dataclass(frozen=True)
class Text:
    """A file's text, and the encoding by which it was read."""

    name: str  # of the file, for messages
    text: str
    encoding: str
    form: str = ""  # in which it says what a table says, where it was none (`oio.tabular.table_text`)
    delimiter: str | None = None  # of the table, where it is certain

    @property
    def line_ends(self) -> str:
        """Which characters end its lines: CR LF, LF, CR, or mixed, judged by the beginning."""
        head = self.text[:LOOKED_AT]
        pairs = head.count("\r\n")
        counts = {"CR LF": pairs, "LF": head.count("\n") - pairs, "CR": head.count("\r") - pairs}
        kinds = [kind for kind, count in counts.items() if count]
        return kinds[0] if len(kinds) == 1 else "mixed (" + ", ".join(f"{counts[kind]} {kind}" for kind in kinds) + ")" if kinds else "none"


def decode(data: bytes, encoding: str | None, name: str) -> Text:
    """Decode a file's bytes; `encoding` None: by its byte order mark, else UTF-8, else Latin-1. Raises BadInput for what is no text.

    Bytes that the encoding does not know become replacement characters, so that they cost their cells and no more.
    """
    for magic, kind, action in NO_TEXT:
        if data.startswith(magic):
            raise BadInput(f"{name} is no table: it is {kind}. {action}")
    chosen = encoding or _encoding(data)
    try:
        text = data.decode(chosen, errors="replace").removeprefix("\ufeff")
    except LookupError:
        raise BadInput(
            f"recording.encoding is '{encoding}', which is none that is known here. Type e.g. utf-8, utf-16 or latin-1."
        ) from None
    head = text[:LOOKED_AT]
    if (
        sum(1 for character in head if character < " " and character not in "\t\r\n\f\0") > 0.02 * len(head) + 2
        or head.count("\0") > len(head) / 2
    ):
        raise BadInput(f"{name} is no table: its bytes are no text ({data[:12]!r}...). Give a CSV, or the file's real encoding.")
    return Text(name, text, chosen)


def _encoding(data: bytes) -> str:
    for mark, encoding in BOMS:
        if data.startswith(mark):
            return encoding
    head = data[:LOOKED_AT]
    half = max(len(head) // 2, 1)
    if head[1::2].count(0) > 0.3 * half and head[::2].count(0) < 0.1 * half:
        return "utf-16-le"
    if head[::2].count(0) > 0.3 * half and head[1::2].count(0) < 0.1 * half:
        return "utf-16-be"
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8"


def lines(text: str, start: int = 0) -> Iterator[re.Match[str]]:
    """Lines from position `start` that hold more than blanks; CR, LF or both end them."""
    return (match for match in LINE.finditer(text, start) if not match[0].isspace())
