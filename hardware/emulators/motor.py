"""What servos of any maker have in common: a motor on a joint, an encoder of 4096 counts, a case that can get hot, a table of registers."""

import math
from collections.abc import Mapping
from typing import TypeVar

from hardware.emulators.device import Joints, Trouble

COUNTS = 4096  # per turn
MIDDLE = 2048  # counts where the joint is at 0 rad
STEP = 2.0 * math.pi / COUNTS  # rad
ROOM_DEGC, HOT_DEGC = 30.0, 90.0
HEATING_DEGC_S = 30.0  # faster than any real servo: a fault lasts seconds
HOT_JOINT = 1  # the second from the base carries most
Register = tuple[int, int]  # address, length
R = TypeVar("R", bound=Register)


class Motor:
    """One joint. A motor without current holds by its gear: it stays where it was let go."""

    def __init__(self, joints: Joints, joint: int, trouble: Trouble) -> None:
        self._joints, self._joint, self._trouble = joints, joint, trouble
        self.degc, self._t_s, self._seen = ROOM_DEGC, 0.0, self._counted()

    def tick(self, t_s: float) -> None:
        """Heat up or cool down until t_s."""
        hot = "hot" in self._trouble and self._joint == min(HOT_JOINT, self._joints.count - 1)
        most = HEATING_DEGC_S * (t_s - self._t_s)
        self.degc += min(max((HOT_DEGC if hot else ROOM_DEGC) - self.degc, -most), most)
        self._t_s = t_s

    @property
    def count(self) -> int:
        """Of the encoder, 0 to 4095."""
        if "stuck" not in self._trouble:
            self._seen = self._counted()
        return self._seen

    def _counted(self) -> int:
        return (round(float(self._joints.angles()[self._joint]) / STEP) + MIDDLE) % COUNTS

    @property
    def counts_per_s(self) -> float:
        """How fast it turns."""
        return 0.0 if "stuck" in self._trouble else float(self._joints.speeds()[self._joint]) / STEP

    @property
    def load(self) -> float:
        """-1 to 1."""
        return 1.0 if "saturated" in self._trouble else float(self._joints.loads()[self._joint])

    def drive(self, count: int) -> None:
        """To where the encoder says so."""
        self._joints.steer(self._joint, (count % COUNTS - MIDDLE) * STEP)

    def let_go(self) -> None:
        """Current off."""
        self._joints.steer(self._joint, float(self._joints.angles()[self._joint]))


class Memory:
    """Registers: little-endian numbers at their addresses."""

    def __init__(self, size: int, values: Mapping[R, int]) -> None:
        self._bytes = bytearray(size)
        for register, value in values.items():
            self[register] = value

    def __getitem__(self, register: Register) -> int:
        """Unsigned."""
        address, length = register
        return int.from_bytes(self._bytes[address : address + length], "little")

    def __setitem__(self, register: Register, value: int) -> None:
        """Negative numbers in two's complement."""
        address, length = register
        self._bytes[address : address + length] = (value % (1 << 8 * length)).to_bytes(length, "little")

    def signed(self, register: Register) -> int:
        """Of two's complement."""
        value, half = self[register], 1 << 8 * register[1] - 1
        return value - 2 * half if value >= half else value

    def read(self, address: int, length: int) -> bytes | None:
        """None beyond the table."""
        return bytes(self._bytes[address : address + length]) if length > 0 and address + length <= len(self._bytes) else None

    def write(self, address: int, data: bytes) -> None:
        """As they come."""
        self._bytes[address : address + len(data)] = data
