"""Protobuf schemas of the `oio.v1` messages, built from a table at import: no protoc, and the whole format can be read here.

Where Foxglove has a schema that fits, it is used instead (`oio/log/encode.py`), so that its viewer draws it without a plug-in.
Units end the names; a message without one holds what its record in `oio/core/records.py` documents. All times are `stamp`.
"""

from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2

SCHEMA_VERSION = "1"  # incremented whenever an old reader would misread a new file
PACKAGE = "oio.v1"

_FIELDS = {  # name: (field, type), ...; numbered from 1 in this order, so new fields go to the end
    "GasSample": (("stamp", "stamp"), ("frame_id", "string"), ("element", "int32"), ("raw", "double")),
    "GasReading": (("stamp", "stamp"), ("element", "int32"), ("ppm", "double"), ("sigma_ppm", "double")),
    "State": (
        ("stamp", "stamp"),
        ("names", "string[]"),
        ("units", "string[]"),
        ("mean", "double[]"),  # (n,)
        ("cov_upper", "double[]"),  # (n (n + 1) / 2,), the upper triangle row by row
    ),
    "Innovation": (
        ("stamp", "stamp"),
        ("residual", "double[]"),  # (m,) ppm
        ("cov", "double[]"),  # (m m,) ppm^2, row by row
        ("nis", "double"),
        ("gated", "bool"),
    ),
    "FilterEstimate": (
        ("stamp", "stamp"),
        ("variant", "string"),
        ("nose_m", "double[]"),  # (3,)
        ("nose_cov_upper", "double[]"),  # (6,) m^2, the upper triangle row by row
        ("source_m", "double[]"),
        ("source_cov_upper", "double[]"),
    ),
    "StageResult": (("stamp", "stamp"), ("stage", "string"), ("state", "string"), ("json", "string")),
    "Event": (("stamp", "stamp"), ("kind", "string"), ("text", "string")),
    "TruthState": (("stamp", "stamp"), ("q", "double[]"), ("nose_m", "double[]"), ("source_m", "double[]"), ("ppm", "double")),
}

_Field = descriptor_pb2.FieldDescriptorProto
_TYPES = {"stamp": _Field.TYPE_MESSAGE, "string": _Field.TYPE_STRING, "int32": _Field.TYPE_INT32}
_TYPES |= {"double": _Field.TYPE_DOUBLE, "bool": _Field.TYPE_BOOL}


def _field(number: int, name: str, kind: str) -> Any:
    repeated = kind.endswith("[]")
    return _Field(
        name=name,
        number=number,
        type=_TYPES[kind.removesuffix("[]")],
        label=_Field.LABEL_REPEATED if repeated else _Field.LABEL_OPTIONAL,
        type_name=".google.protobuf.Timestamp" if kind == "stamp" else None,
    )


def _file() -> Any:
    file = descriptor_pb2.FileDescriptorProto(name="oio/v1.proto", package=PACKAGE, syntax="proto3")
    file.dependency.append(timestamp_pb2.DESCRIPTOR.name)
    for name, fields in _FIELDS.items():
        file.message_type.add(name=name, field=[_field(i, *field) for i, field in enumerate(fields, start=1)])
    return file


def _classes() -> dict[str, Any]:
    pool = descriptor_pool.DescriptorPool()  # private: no `oio.v1` of another package can collide with this one
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    pool.AddSerializedFile(_file().SerializeToString())
    return {name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{PACKAGE}.{name}")) for name in _FIELDS}


_message_classes = _classes()
GasSample = _message_classes["GasSample"]
GasReading = _message_classes["GasReading"]
State = _message_classes["State"]
FilterEstimate = _message_classes["FilterEstimate"]
Innovation = _message_classes["Innovation"]
StageResult = _message_classes["StageResult"]
Event = _message_classes["Event"]
TruthState = _message_classes["TruthState"]
