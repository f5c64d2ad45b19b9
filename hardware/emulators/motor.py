"""Common parts of emulated servos of any maker: motor, 4096-count encoder, case temperature, register table."""

import math
from collections.abc import Mapping
from typing import TypeVar

from hardware.emulators.device import Joints, Trouble

COUNTS = 4096  # per turn
MIDDLE = 2048  # counts where the joint is at 0 rad
STEP = 2.0 * math.pi / COUNTS  # rad
ROOM_DEGC, HOT_DEGC = 30.0, 90.0
HEATING_DEGC_S = 30.0  # faster than any real servo, because a fault lasts seconds
HOT_JOINT = 1  # the second joint from the base carries the largest load
Register = tuple[int, int]  # address, length
R = TypeVar("R", bound=Register)


class Motor:
    """Motor of one joint. Without current its gearbox is self-locking: the joint stays where it was released."""

    def __init__(self, joints: Joints, joint: int, trouble: Trouble) -> None:
        self._joints, self._joint, self._trouble = joints, joint, trouble
        self.degc, self._t_s, self._last_count = ROOM_DEGC, 0.0, self._encoder_count()

    def tick(self, t_s: float) -> None:
        """Heat up or cool down until t_s."""
        hot = "hot" in self._trouble and self._joint == min(HOT_JOINT, self._joints.count - 1)
        max_change = HEATING_DEGC_S * (t_s - self._t_s)
        self.degc += min(max((HOT_DEGC if hot else ROOM_DEGC) - self.degc, -max_change), max_change)
        self._t_s = t_s

    @property
    def count(self) -> int:
        """Encoder count, 0 to 4095."""
        if "stuck" not in self._trouble:
            self._last_count = self._encoder_count()
        return self._last_count

    def _encoder_count(self) -> int:
        return (round(float(self._joints.angles()[self._joint]) / STEP) + MIDDLE) % COUNTS

    @property
    def counts_per_s(self) -> float:
        """Angular velocity [counts/s]."""
        return 0.0 if "stuck" in self._trouble else float(self._joints.speeds()[self._joint]) / STEP

    @property
    def load(self) -> float:
        """Torque over the largest torque, -1 to 1."""
        return 1.0 if "saturated" in self._trouble else float(self._joints.loads()[self._joint])

    def drive(self, count: int) -> None:
        """Move to an encoder count."""
        self._joints.steer(self._joint, (count % COUNTS - MIDDLE) * STEP)

    def release(self) -> None:
        """Switch the current off."""
        self._joints.steer(self._joint, float(self._joints.angles()[self._joint]))


class Memory:
    """Register table: little-endian integers at their addresses."""

    def __init__(self, size: int, values: Mapping[R, int]) -> None:
        self._bytes = bytearray(size)
        for register, value in values.items():
            self[register] = value

    def __getitem__(self, register: Register) -> int:
        """Read a register as an unsigned integer."""
        address, length = register
        return int.from_bytes(self._bytes[address : address + length], "little")

    def __setitem__(self, register: Register, value: int) -> None:
        """Write a register; negative values in two's complement."""
        address, length = register
        self._bytes[address : address + length] = (value % (1 << 8 * length)).to_bytes(length, "little")

    def signed(self, register: Register) -> int:
        """Read a register in two's complement."""
        value, half = self[register], 1 << 8 * register[1] - 1
        return value - 2 * half if value >= half else value

    def read(self, address: int, length: int) -> bytes | None:
        """Read bytes; None beyond the table."""
        return bytes(self._bytes[address : address + length]) if length > 0 and address + length <= len(self._bytes) else None

    def write(self, address: int, data: bytes) -> None:
        """Write bytes as given."""
        self._bytes[address : address + len(data)] = data
