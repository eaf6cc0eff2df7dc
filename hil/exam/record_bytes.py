"""Records of an exam as Parquet whose size tells nothing: columns as they are, neither compressed nor indexed."""

from __future__ import annotations

import io
from typing import Final

from ident.errors import UserError
from ident.records.record import Record
from ident.records.table import CHANNEL_UNITS, record_from_table, table_from_record

LEFT_OUT: Final = "command_torque_"
"""Channels that are not part of an exam: what the drives report has to do."""


def record_bytes(record: Record) -> bytes:
    """A record as Parquet with units.

    Raises:
        UserError: pyarrow is not installed.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise UserError("An exam needs pyarrow.", "Install it: pip install 'quasiomni[records]'.") from error
    table = {name: values for name, values in table_from_record(record).items() if not name.startswith(LEFT_OUT)}
    arrays = [pa.array(values) for values in table.values()]
    schema = pa.schema(
        [
            pa.field(name, array.type, metadata={"unit": CHANNEL_UNITS.get(name, "")})
            for name, array in zip(table, arrays, strict=True)
        ]
    )
    file = io.BytesIO()
    pq.write_table(
        pa.table(arrays, schema=schema), file, compression="none", use_dictionary=["step"], write_statistics=False
    )
    return file.getvalue()


def record_from_bytes(content: bytes, source: str) -> Record:
    """The record of `record_bytes`; `source` is named in messages."""
    import pyarrow.parquet as pq

    table = pq.read_table(io.BytesIO(content))
    return record_from_table({name: table.column(name).to_numpy() for name in table.column_names}, source)
