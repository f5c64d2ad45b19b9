"""Bytes of a table file: as they are, unpacked (.gz), or as text (.parquet, .mcap)."""

import gzip
import io
import zlib
from pathlib import Path

from oio.core.errors import BadInput

MCAP = b"\x89MCAP"


def file_bytes(path: Path, rows_of: str | None = None) -> bytes:
    """Return the bytes of a table; of a Parquet file those of the same table as CSV, of an MCAP log those of the table of the topic that
    has the column `rows_of`. Raises BadInput if it cannot be read."""
    try:
        data = path.read_bytes()
        if path.suffix == ".parquet" or data[:4] == b"PAR1":
            return _parquet(path, data)
        if data.startswith(MCAP):
            from oio.log.foreign import as_csv

            return as_csv(data, path.name, rows_of)
        return gzip.decompress(data) if path.suffix == ".gz" else data
    except (OSError, EOFError, zlib.error) as error:
        raise BadInput(f"{path} cannot be read ({error}).") from None


def _parquet(path: Path, data: bytes) -> bytes:
    try:
        import pyarrow
        from pyarrow import csv, parquet
    except ImportError:
        raise BadInput(f"{path} is a Parquet file, which needs pyarrow. Type pip install 'oio[parquet]'.") from None
    written = io.BytesIO()
    try:
        table = parquet.read_table(io.BytesIO(data))
        while any(pyarrow.types.is_struct(column.type) for column in table.schema):
            table = table.flatten()  # position: {x, y, z} becomes position.x, position.y, position.z
        plain = [column.name for column in table.schema if not pyarrow.types.is_nested(column.type)]
        csv.write_csv(table.select(plain), written)  # lists are no columns of a table
    except pyarrow.ArrowException as error:
        raise BadInput(f"{path} cannot be read ({error}).") from None
    return written.getvalue()
