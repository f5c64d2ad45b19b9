"""Codec of the SCD4x on I2C, behind a SEK-SensorBridge: words with CRC-8, and the bridge's commands that carry them.

Sensirion, SCD4x data sheet v1.7, April 2025; the bridge's commands and field order: sensirion-shdlc-sensorbridge 0.2.0 (BSD-3).
"""

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

ADDRESS = 0x62  # on I2C

# Commands. The comment gives the time for which the device is busy with it.
START = 0x21B1  # periodic, every 5 s
READ = 0xEC05  # 1 ms; 3 words; empties the buffer, and an empty buffer answers with NACK
STOP = 0x3F86  # 500 ms
READY = 0xE4B8  # 1 ms; 1 word
SERIAL = 0x3682  # 1 ms; 3 words, most significant first
VARIANT = 0x202F  # 1 ms; 1 word
SINGLE_SHOT = 0x219D  # 5 s
FORCED_RECALIBRATION = 0x362F  # 400 ms; takes ppm, gives 0x8000 + correction [ppm], 0xFFFF: failed
SELF_CALIBRATION = 0x2416  # 1 ms; takes 0 or 1
PRESSURE = 0xE000  # 1 ms; takes Pa / 100
SELF_TEST = 0x3639  # 10 s; 1 word, 0: no fault found
REINIT = 0x3646  # 30 ms

VARIANT_MASK = 0xF000
SCD40, SCD41, SCD43 = 0x0000, 0x1000, 0x5000  # of the masked word; as read from a real SCD41: 0x1440

# Commands of the bridge (of the SHDLC frame)
SET_VOLTAGE, SUPPLY, I2C_FREQUENCY, I2C_SCAN, TRANSCEIVE, DEVICE_INFO, VERSION = 0x00, 0x01, 0x02, 0x10, 0x11, 0xD0, 0xD1
VOLTS_3V3, KHZ_100, KHZ_400 = 0x02, 0x00, 0x01  # arguments of SET_VOLTAGE and I2C_FREQUENCY, behind the port
MOST_TX = 255 - 15  # largest number of I2C bytes that one frame can carry

_HEAD = struct.Struct(">BBBIII")  # 0: first part, port, I2C address, bytes to send, bytes to receive, time-out [us]


def _shifted(byte: int) -> int:
    for _ in range(8):
        byte = (byte << 1 ^ (0x31 if byte & 0x80 else 0)) & 0xFF
    return byte


_TABLE = tuple(_shifted(byte) for byte in range(256))


@dataclass(frozen=True, slots=True)
class Transfer:
    """I2C transfer request to the bridge: send `tx`, then receive `rx_len` bytes."""

    port: int
    i2c_address: int
    tx: bytes
    rx_len: int
    timeout_us: int


def crc8(data: bytes) -> int:
    """CRC-8, polynomial 0x31, initial value 0xFF (data sheet, section 3.12)."""
    crc = 0xFF
    for byte in data:
        crc = _TABLE[crc ^ byte]
    return crc


def packed(words: Iterable[int]) -> bytes:
    """Encode each word as two bytes, most significant first, and their CRC."""
    return b"".join(word.to_bytes(2, "big") + bytes((crc8(word.to_bytes(2, "big")),)) for word in words)


def unpacked(data: bytes) -> tuple[int, ...] | None:
    """Decode the words of `packed`; None if the length is no multiple of 3 or a CRC is wrong."""
    triples = [data[at : at + 3] for at in range(0, len(data), 3)]
    if any(len(triple) != 3 or crc8(triple[:2]) != triple[2] for triple in triples):
        return None
    return tuple(int.from_bytes(triple[:2], "big") for triple in triples)


def command(code: int, *words: int) -> bytes:
    """Encode an I2C command: its code, without CRC, and its arguments, with CRC."""
    return code.to_bytes(2, "big") + packed(words)


def commanded(tx: bytes) -> tuple[int, tuple[int, ...]] | None:
    """Device side of `command`: return code and arguments; None if too short or a CRC is wrong."""
    words = unpacked(tx[2:])
    return None if len(tx) < 2 or words is None else (int.from_bytes(tx[:2], "big"), words)


def is_ready(word: int) -> bool:
    """Whether a measurement is ready, from the reply to READY: one of its low 11 bits is set."""
    return word & 0x7FF != 0


def measured(words: Sequence[int]) -> tuple[float, float, float]:
    """Decode (ppm, degC, %RH) from the three words of READ (data sheet, section 3.6.2)."""
    ppm, temperature, humidity = words
    return float(ppm), -45 + 175 * temperature / 65535, 100 * humidity / 65535


def words_measured(ppm: float, degc: float, pct_rh: float) -> tuple[int, int, int]:
    """Encode (ppm, degC, %RH) as the nearest words, clipped to the range of a word."""
    near = (round(min(max(value, 0), 65535)) for value in (ppm, (degc + 45) * 65535 / 175, pct_rh * 65535 / 100))
    return next(near), next(near), next(near)


def transceive(i2c_address: int, tx: bytes, rx_len: int, timeout_us: int, port: int = 0) -> bytes:
    """Encode the data of the bridge's command TRANSCEIVE; port 0 is the socket labelled 1. Raises ValueError."""
    if len(tx) > MOST_TX:
        raise ValueError(f"one frame carries at most {MOST_TX} bytes to I2C, not {len(tx)}")
    return _HEAD.pack(0, port, i2c_address, len(tx), rx_len, timeout_us) + tx


def transfer(data: bytes) -> Transfer | None:
    """Device side of `transceive`; None if it is no first part or its lengths disagree."""
    if len(data) < _HEAD.size:
        return None
    part, port, i2c_address, tx_len, rx_len, timeout_us = _HEAD.unpack_from(data)
    tx = data[_HEAD.size :]
    return Transfer(port, i2c_address, tx, rx_len, timeout_us) if part == 0 and len(tx) == tx_len else None
