"""Microcontroller with the line protocol (hardware/firmware/nose): what the nose and the valve drivers share."""

from hardware.codecs.line import Lines, command
from hardware.transport.port import Wire
from hardware.transport.request import request_until

BAUD = 115_200
BOOT_S = 3.0  # the bootloader of an Arduino, which every opening of its port resets, takes 1 to 2 s
ANSWER_S = 0.3  # time-out before a retry


def acknowledged(wire: Wire, lines: Lines, text: str, within_s: float = 0.0) -> tuple[str, ...]:
    """Send a command and return the fields of its acknowledgement; retried for within_s [s]. Raises NoAnswer."""
    return request_until(wire, command(text), lines, lambda fields: fields[:2] == ("ACK", text), ANSWER_S, within_s)
