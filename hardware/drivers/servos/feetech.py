"""Driver of Feetech STS3215 servos at 1 Mbaud."""

from collections.abc import Callable, Sequence

import numpy as np

from hardware.codecs import sts
from hardware.drivers.servos.bus import Positions, ServoHealth, ServoState, ask_all, ask_one
from hardware.transport.port import NoAnswer, Wire

PRESENT = sts.Register(sts.PRESENT_POSITION.address, 6)  # position, velocity, load
HEALTH = sts.Register(sts.TORQUE_ENABLE.address, 24)  # torque, goal, voltage, temperature
MODELS = {sts.STS3215_MODEL: "STS3215"}
POSITION_MODE = 0
COMPLAINTS = {
    sts.VOLTAGE_ERROR: "a wrong voltage",
    sts.ANGLE_ERROR: "a wrong angle",
    sts.OVERHEAT: "overheating",
    sts.OVERCURRENT: "too much current",
    sts.OVERLOAD: "overload",
}
SIGN_POSITION, SIGN_LOAD = 15, 10  # sign bits; values are in sign and magnitude
LOAD_FULL = 1000.0  # unit: 0.1 %


class Feetech:
    """Bus of Feetech STS3215 servos, as in the SO-101."""

    name, baud, counts_per_turn, middle = "feetech", 1_000_000, sts.TICKS_PER_TURN, 2048

    def __init__(self) -> None:
        self._packets = sts.Packets()

    def framer(self) -> sts.Packets:
        """See `Bus`."""
        return self._packets

    def ping(self, wire: Wire, servo: int) -> str | None:
        """See `Bus`."""
        try:
            model = self._number(self._read(wire, servo, sts.MODEL))
        except NoAnswer:
            return None
        return MODELS.get(model, f"model {model}")

    def configure(self, wire: Wire, ids: Sequence[int]) -> None:
        """See `Bus`. EPROM is written only where it differs, because it wears."""
        for servo in ids:
            for register, wanted in ((sts.RETURN_DELAY, 0), (sts.MODE, POSITION_MODE)):
                if self._number(self._read(wire, servo, register)) != wanted:
                    self._write(wire, servo, sts.TORQUE_ENABLE, 0)
                    self._write(wire, servo, sts.LOCK, 0)
                    self._write(wire, servo, register, wanted)
                    self._write(wire, servo, sts.LOCK, 1)

    def read_state(self, wire: Wire, ids: Sequence[int]) -> ServoState:
        """See `Bus`."""
        question = sts.sync_read(*PRESENT, ids)
        packets = ask_all(wire, question, self._packets, ids, _of(PRESENT.length))
        words = np.array([np.frombuffer(p.params, dtype="<u2") for p in packets], dtype=np.int64)
        counts = [sts.signed(int(w), SIGN_POSITION) for w in words[:, 0]]
        load = np.array([abs(sts.signed(int(w), SIGN_LOAD)) for w in words[:, 2]]) / LOAD_FULL
        return ServoState(np.array(counts), load, next((fault for p in packets if (fault := _fault(p))), None))

    def write_goals(self, wire: Wire, ids: Sequence[int], counts: Positions) -> None:
        """See `Bus`."""
        data = {s: sts.magnitude(int(c), SIGN_POSITION).to_bytes(2, "little") for s, c in zip(ids, counts, strict=True)}
        wire.write(sts.sync_write(sts.GOAL_POSITION.address, data))

    def torque(self, wire: Wire, ids: Sequence[int], on: bool) -> None:
        """See `Bus`."""
        for servo in ids:
            fault = _fault(self._write(wire, servo, sts.TORQUE_ENABLE, int(on)))
            if on and fault:
                raise NoAnswer(fault)

    def health(self, wire: Wire, servo: int) -> ServoHealth:
        """See `Bus`."""
        data = ask_all(wire, sts.read(servo, *HEALTH), self._packets, [servo], _of(HEALTH.length))[0].params
        goal, voltage, temperature = (_at(data, r) for r in (sts.GOAL_POSITION, sts.PRESENT_VOLTAGE, sts.PRESENT_TEMPERATURE))
        return ServoHealth(data[0] == 1, sts.signed(goal, SIGN_POSITION), 0.1 * voltage, float(temperature))

    def _read(self, wire: Wire, servo: int, register: sts.Register) -> bytes:
        return ask_one(wire, sts.read(servo, *register), self._packets, servo, _of(register.length)).params

    def _write(self, wire: Wire, servo: int, register: sts.Register, value: int) -> sts.Packet:
        question = sts.write(servo, register.address, value.to_bytes(register.length, "little"))
        return ask_one(wire, question, self._packets, servo, _of(0))

    @staticmethod
    def _number(data: bytes) -> int:
        return int.from_bytes(data, "little")


def _at(health: bytes, register: sts.Register) -> int:
    start = register.address - HEALTH.address
    return int.from_bytes(health[start : start + register.length], "little")


def _fault(packet: sts.Packet) -> str | None:
    """Text of the error bits of a reply; None if there are none."""
    names = [name for bit, name in COMPLAINTS.items() if packet.code & bit]
    return f"servo {packet.id} reports {' and '.join(names)}" if names else None


def _of(length: int) -> Callable[[sts.Packet], int | None]:
    """Return a function that maps a reply of `length` parameter bytes to its servo id, other packets to None."""
    return lambda packet: packet.id if len(packet.params) == length else None
