"""Driver of Dynamixel X-series servos, protocol 2.0, at 1 Mbaud."""

from collections.abc import Callable, Sequence

import numpy as np

from hardware.codecs import dynamixel
from hardware.drivers.servos.bus import Positions, ServoHealth, ServoState, ask_all, ask_one
from hardware.transport.port import NoAnswer, Wire
from oio.core.errors import OioError

LIMIT = dynamixel.Register(38, 2)  # current limit, in the unit of PRESENT_CURRENT
PRESENT = dynamixel.Register(dynamixel.PRESENT_CURRENT.address, 10)  # current, velocity, position
HEALTH = dynamixel.Register(dynamixel.TORQUE_ENABLE.address, 83)  # torque, goal, voltage, temperature
POSITION_MODE = 3
STATUS = 0x55


class Dynamixel:
    """Bus of Dynamixel X-series servos."""

    name, baud, counts_per_turn, middle = "dynamixel", 1_000_000, dynamixel.TICKS_PER_TURN, 2048

    def __init__(self) -> None:
        self._packets, self._current_limit = dynamixel.Packets(), dict[int, int]()

    def framer(self) -> dynamixel.Packets:
        """See `Bus`."""
        return self._packets

    def ping(self, wire: Wire, servo: int) -> str | None:
        """See `Bus`."""
        try:
            return f"model {self._number(self._read(wire, servo, dynamixel.MODEL))}"
        except NoAnswer:
            return None

    def configure(self, wire: Wire, ids: Sequence[int]) -> None:
        """See `Bus`. EEPROM is written only where it differs, and only with torque disabled."""
        for servo in ids:
            for register, wanted in ((dynamixel.RETURN_DELAY, 0), (dynamixel.OPERATING_MODE, POSITION_MODE)):
                if self._number(self._read(wire, servo, register)) != wanted:
                    self._write(wire, servo, dynamixel.TORQUE_ENABLE, 0)
                    self._write(wire, servo, register, wanted)
            self._current_limit[servo] = self._number(self._read(wire, servo, LIMIT))
            if self._current_limit[servo] == 0:
                raise OioError(f"servo {servo} measures no current (as XL430 and XC430), so the arm could not detect an obstacle.")

    def read_state(self, wire: Wire, ids: Sequence[int]) -> ServoState:
        """See `Bus`; load is the present current over the current limit."""
        question = dynamixel.sync_read(*PRESENT, ids)
        packets = ask_all(wire, question, self._packets, ids, _of(PRESENT.length))
        fields = [np.frombuffer(p.params, dtype=[("current", "<i2"), ("velocity", "<i4"), ("position", "<i4")])[0] for p in packets]
        load = np.array([abs(int(f["current"])) / self._current_limit[s] for f, s in zip(fields, ids, strict=True)])
        return ServoState(
            np.array([int(f["position"]) for f in fields]), load, next((fault for p in packets if (fault := _fault(p))), None)
        )

    def write_goals(self, wire: Wire, ids: Sequence[int], counts: Positions) -> None:
        """See `Bus`."""
        data = {servo: int(count).to_bytes(4, "little", signed=True) for servo, count in zip(ids, counts, strict=True)}
        wire.write(dynamixel.sync_write(dynamixel.GOAL_POSITION.address, data))

    def torque(self, wire: Wire, ids: Sequence[int], on: bool) -> None:
        """See `Bus`."""
        for servo in ids:
            packet = self._write(wire, servo, dynamixel.TORQUE_ENABLE, int(on))
            if on and packet.error:
                raise NoAnswer(_fault(packet) or f"servo {servo} refuses to hold with error {packet.error}")

    def health(self, wire: Wire, servo: int) -> ServoHealth:
        """See `Bus`."""
        data = ask_all(wire, dynamixel.read(servo, *HEALTH), self._packets, [servo], _of(HEALTH.length))[0].params
        voltage, temperature = (_at(data, r) for r in (dynamixel.PRESENT_VOLTAGE, dynamixel.PRESENT_TEMPERATURE))
        return ServoHealth(data[0] == 1, _at(data, dynamixel.GOAL_POSITION), 0.1 * voltage, float(temperature))

    def _read(self, wire: Wire, servo: int, register: dynamixel.Register) -> bytes:
        return ask_one(wire, dynamixel.read(servo, *register), self._packets, servo, _of(register.length)).params

    def _write(self, wire: Wire, servo: int, register: dynamixel.Register, value: int) -> dynamixel.Packet:
        question = dynamixel.write(servo, register.address, value.to_bytes(register.length, "little"))
        return ask_one(wire, question, self._packets, servo, _of(0))

    @staticmethod
    def _number(data: bytes) -> int:
        return int.from_bytes(data, "little")


def _at(health: bytes, register: dynamixel.Register) -> int:
    start = register.address - HEALTH.address
    return int.from_bytes(health[start : start + register.length], "little", signed=True)


def _fault(packet: dynamixel.Packet) -> str | None:
    if not packet.error & dynamixel.ALERT:
        return None
    return f"servo {packet.id} reports a hardware error (overload, heat, voltage, encoder): switch the servos' supply off and on"


def _of(length: int) -> Callable[[dynamixel.Packet], int | None]:
    """Return a function that maps a reply of `length` parameter bytes to its servo id, other packets to None."""
    return lambda packet: packet.id if packet.instruction == STATUS and len(packet.params) == length else None
