"""Emulated bus of Feetech STS3215 servos (memory table: see hardware/codecs/sts.py), ids from 1.

Only position mode moves a joint. Locked EPROM cannot be written at all; in a real servo such a change lasts until power-off.
"""

import numpy as np

from hardware.codecs import sts
from hardware.emulators.bus import TICK_S, Bus
from hardware.emulators.device import Joints, Trouble
from hardware.emulators.motor import COUNTS, Memory, Motor
from oio.core.records import Array

SIZE, EPROM = 128, 40  # bytes of the emulated table; below 40 it is EPROM
READ_ONLY = (range(0, 5), range(56, 71))
FACTORY = {
    sts.MODEL: sts.STS3215_MODEL,
    sts.BAUD: 0,  # 1 M
    sts.RETURN_DELAY: 250,  # 0.5 ms
    sts.MAX_POSITION: COUNTS - 1,
    sts.MAX_TEMPERATURE: 70,
    sts.P: 32,
    sts.D: 32,
    sts.TORQUE_LIMIT: 1000,
    sts.LOCK: 1,
    sts.PRESENT_VOLTAGE: 74,
}
OFFSET_SIGN, POSITION_SIGN, LOAD_SIGN = 11, 15, 10
MOVES_COUNTS_S = 20.0  # assumption: above this speed the MOVING register is set


class Servo:
    """Emulated STS3215. Position is the encoder count less the homing offset, within one turn; velocity is in counts/s."""

    def __init__(self, id: int, motor: Motor, trouble: Trouble) -> None:
        self.id, self._motor, self._trouble = id, motor, trouble
        self._memory = Memory(SIZE, FACTORY | {sts.ID: id})
        self._refresh()
        self._memory[sts.GOAL_POSITION] = self._memory[sts.PRESENT_POSITION]

    @property
    def delay_s(self) -> float:
        """Return delay before a reply [s]."""
        return self._memory[sts.RETURN_DELAY] * TICK_S

    def tick(self, t_s: float) -> None:
        """Advance to t_s; on overheating disable torque."""
        self._motor.tick(t_s)
        if self._error & sts.OVERHEAT and self._memory[sts.TORQUE_ENABLE]:
            self._memory[sts.TORQUE_ENABLE] = 0
            self._motor.release()

    def power_on(self) -> None:
        """Restart with torque disabled and the goal at the present position."""
        self._refresh()
        self._memory[sts.TORQUE_ENABLE] = 0
        self._memory[sts.GOAL_POSITION] = self._memory[sts.PRESENT_POSITION]
        self._motor.release()

    def obey(self, instruction: int, params: bytes) -> bytes:
        """Execute an instruction; return its status packet, or nothing for an unknown instruction."""
        if "nack" in self._trouble:
            return sts.status(self.id, sts.OVERLOAD)
        if instruction == sts.PING:
            return sts.status(self.id, self._error)
        if instruction == sts.READ and len(params) == 2:
            return self.told(*params)
        if instruction == sts.WRITE and len(params) > 1:
            return sts.status(self.id, self.write(params[0], params[1:]))
        return b""

    def told(self, address: int, length: int) -> bytes:
        """Return the status packet of a read."""
        if "nack" in self._trouble:
            return sts.status(self.id, sts.OVERLOAD)
        self._refresh()
        data = self._memory.read(address, length)
        return b"" if data is None else sts.status(self.id, self._error, data)

    def write(self, address: int, data: bytes) -> int:
        """Write byte by byte where it is allowed, ignoring the rest; return the error bits."""
        held, locked = self._memory[sts.TORQUE_ENABLE], self._memory[sts.LOCK] != 0
        for at, byte in enumerate(data, address):
            if at < SIZE and not (at < EPROM and locked) and not any(at in span for span in READ_ONLY):
                self._memory.write(at, bytes((byte,)))
        if self._memory[sts.TORQUE_ENABLE]:
            self._drive()
        elif held:
            self._motor.release()
        return self._error

    @property
    def _error(self) -> int:
        return sts.OVERHEAT if self._motor.degc > self._memory[sts.MAX_TEMPERATURE] else 0

    @property
    def _offset(self) -> int:
        return sts.signed(self._memory[sts.HOMING_OFFSET], OFFSET_SIGN)

    def _drive(self) -> None:
        if self._memory[sts.MODE] == 0:
            goal = sts.signed(self._memory[sts.GOAL_POSITION], POSITION_SIGN)
            allowed = min(max(goal, self._memory[sts.MIN_POSITION]), self._memory[sts.MAX_POSITION])
            self._motor.drive(allowed + self._offset)

    def _refresh(self) -> None:
        """Refresh the measured registers."""
        memory, motor = self._memory, self._motor
        speed = round(motor.counts_per_s)
        memory[sts.PRESENT_POSITION] = (motor.count - self._offset) % COUNTS
        memory[sts.PRESENT_VELOCITY] = sts.magnitude(min(max(speed, -32767), 32767), POSITION_SIGN)
        memory[sts.PRESENT_LOAD] = sts.magnitude(round(1000 * motor.load), LOAD_SIGN)
        memory[sts.PRESENT_TEMPERATURE] = round(motor.degc)
        memory[sts.STATUS], memory[sts.MOVING] = self._error, int(abs(speed) > MOVES_COUNTS_S)


class Gripper:
    """See `Joints`: the one joint of a gripper, which is at once where it is led, and carries nothing."""

    count = 1

    def __init__(self) -> None:
        self._angle_rad = 0.0

    def angles(self) -> Array:
        """See `Joints`."""
        return np.array([self._angle_rad])

    def speeds(self) -> Array:
        """See `Joints`."""
        return np.zeros(1)

    def loads(self) -> Array:
        """See `Joints`."""
        return np.zeros(1)

    def steer(self, joint: int, goal_rad: float) -> None:
        """See `Joints`."""
        self._angle_rad = goal_rad


class Feetech(Bus):
    """Emulated bus of Feetech servos, ids from 1; `gripper`: one more behind those of the arm."""

    def __init__(self, joints: Joints, trouble: Trouble, gripper: bool = False) -> None:
        motors = [Motor(joints, i, trouble) for i in range(joints.count)] + ([Motor(Gripper(), 0, trouble)] if gripper else [])
        super().__init__({i: Servo(i, motor, trouble) for i, motor in enumerate(motors, start=1)}, trouble)
        self._packets = sts.Packets()

    def _answer(self, data: bytes) -> bytes:
        return b"".join(self._execute(packet) for packet in self._packets.feed(data))

    def _execute(self, packet: sts.Packet) -> bytes:
        p = packet.params
        if packet.code == sts.SYNC_READ and len(p) >= 2:
            return self._read_all(p[0], p[1], p[2:])
        if packet.code == sts.SYNC_WRITE and len(p) >= 2:
            self._write_all(p[0], p[1], p[2:])
        elif packet.id == sts.BROADCAST and packet.code == sts.WRITE and len(p) > 1:
            for servo in self._servos.values():
                servo.write(p[0], p[1:])
        else:
            return self._one(packet.id, packet.code, p)
        return b""
