"""Records of an exam of axes as Parquet: as long as the machine moves, whatever it lacks."""

from __future__ import annotations

import io

from ident.records.axis_record import AxisKind, AxisRecord, axis_record_from_channels
from ident.records.channels import Channels


def axis_record_bytes(record: AxisRecord) -> bytes:
    """A record without repeats; how long it is follows from the machine alone."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    (axis,) = record.axes
    table = pa.table({"time": record.time, "position": axis.position, "effort": axis.effort})
    file = io.BytesIO()
    pq.write_table(table, file, compression="none", use_dictionary=False, write_statistics=False)
    return file.getvalue()


def axis_record_of(content: bytes, source: str) -> AxisRecord:
    """The record of `axis_record_bytes`; `source` is named in messages."""
    import pyarrow.parquet as pq

    table = pq.read_table(io.BytesIO(content))
    channels = Channels({name: table.column(name).to_numpy() for name in table.column_names}, {})
    return axis_record_from_channels(channels, source, AxisKind.LINEAR)
