"""The numbers in a decoded message, by their path: `header.stamp`, `data`, `position.shoulder_pan`, `values[3]`."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

LONGEST = 64  # elements of a list; longer ones are pictures or scans
DEEPEST = 8
SECONDS, NANOSECONDS = ("sec", "secs", "seconds"), ("nanosec", "nsec", "nanos", "nsecs")


def numbers(message: Any) -> dict[str, float]:
    """Return the numbers of a message of JSON, Protobuf or ROS 2; a time of seconds and nanoseconds is one number [s]."""
    return dict(_walk("", message, 0))


def _walk(path: str, value: Any, depth: int) -> Iterator[tuple[str, float]]:
    if isinstance(value, bool | int | float):
        yield path or "value", float(value)
        return
    if isinstance(value, str | bytes | bytearray | memoryview) or value is None or depth > DEEPEST:
        return
    if isinstance(value, Sequence) or hasattr(value, "__array__"):
        yield from _list(path, list(value)[: LONGEST + 1], (), depth)
        return
    fields = _fields(value)
    stamp = _stamp(fields)
    if stamp is not None:
        yield path or "stamp", stamp
        return
    names = fields.get("name", fields.get("names"))
    for key, inner in fields.items():
        below = f"{path}.{key}" if path else key
        if isinstance(inner, Sequence) and not isinstance(inner, str | bytes) and _name_all(names, inner):
            yield from _list(below, list(inner), [str(one) for one in names or ()], depth)
        else:
            yield from _walk(below, inner, depth + 1)


def _list(path: str, values: list[Any], names: Sequence[str], depth: int) -> Iterator[tuple[str, float]]:
    if len(values) > LONGEST:
        return
    names = names or _own_names(values)
    for i, value in enumerate(values):
        yield from _walk(f"{path}.{names[i]}" if names else f"{path}[{i}]", value, depth + 1)


def _own_names(values: Sequence[Any]) -> list[str]:
    """Names that the elements of a list give themselves, as in foxglove.JointStates; none if one has none, or two are equal."""
    fields = [{} if isinstance(value, bool | int | float | str | bytes) or value is None else _fields(value) for value in values]
    names = [str(one.get("name", "")) for one in fields]
    return names if all(names) and len(set(names)) == len(names) else []


def _name_all(names: Any, values: Sequence[Any]) -> bool:
    """Whether these are the names of those values, as in sensor_msgs/JointState."""
    return (
        isinstance(names, Sequence)
        and not isinstance(names, str | bytes)
        and 0 < len(names) == len(values)
        and all(isinstance(one, str) for one in names)
    )


def _fields(message: Any) -> Mapping[str, Any]:
    if isinstance(message, Mapping):
        return {str(key): value for key, value in message.items()}
    if hasattr(message, "DESCRIPTOR"):  # Protobuf
        return {one.name: getattr(message, one.name) for one in message.DESCRIPTOR.fields}
    return {name: getattr(message, name) for name in getattr(message, "__slots__", ()) if not name.startswith("_")}


def _stamp(fields: Mapping[str, Any]) -> float | None:
    if len(fields) != 2:
        return None
    seconds = next((fields[name] for name in SECONDS if name in fields), None)
    nanoseconds = next((fields[name] for name in NANOSECONDS if name in fields), None)
    if not isinstance(seconds, int | float) or not isinstance(nanoseconds, int | float):
        return None
    return float(seconds) + 1e-9 * float(nanoseconds)
