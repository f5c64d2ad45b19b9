"""A microcontroller that speaks the line protocol (hardware/firmware/nose): what its nose and its valve share."""

from hardware.codecs.line import Lines, command
from hardware.transport.port import Wire
from hardware.transport.request import request_until

BAUD = 115_200
BOOT_S = 3.0  # 1 to 2 s in the bootloader of an Arduino, which every opening of its port resets
ANSWER_S = 0.3  # then it is asked again


def acknowledged(wire: Wire, lines: Lines, text: str, within_s: float = 0.0) -> tuple[str, ...]:
    """The fields with which a command was acknowledged; asked again for so long. Raises NoAnswer."""
    return request_until(wire, command(text), lines, lambda fields: fields[:2] == ("ACK", text), ANSWER_S, within_s)
