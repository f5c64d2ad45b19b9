"""Emulated bus of Dynamixel X-series servos (XM430-W350; control table: see hardware/codecs/dynamixel.py), ids from 1, set to 1 Mbaud.

Only position mode moves a joint. EEPROM cannot be written while torque is enabled, as in the real servo.
"""

from hardware.codecs import dynamixel as dxl
from hardware.emulators.bus import TICK_S, Bus
from hardware.emulators.device import Joints, Trouble
from hardware.emulators.motor import COUNTS, Memory, Motor

MODEL_XM430_W350, FIRMWARE = 1020, 45
SIZE, EEPROM = 147, 64  # bytes of the emulated table; below 64 it is EEPROM
READ_ONLY = (range(0, 7), range(70, 71), range(122, 147))
# beyond what the codec names: e-Manual, XM430-W350
FIRMWARE_VERSION, TEMPERATURE_LIMIT, CURRENT_LIMIT, MOVING = (6, 1), (31, 1), (38, 2), (122, 1)
REBOOT = 0x08
FACTORY = {
    dxl.MODEL: MODEL_XM430_W350,
    FIRMWARE_VERSION: FIRMWARE,
    dxl.BAUD: 3,  # 1 M; factory default 57 600
    dxl.RETURN_DELAY: 250,  # 0.5 ms
    dxl.OPERATING_MODE: 3,  # position
    TEMPERATURE_LIMIT: 80,
    CURRENT_LIMIT: 1193,  # unit: 2.69 mA
    dxl.MAX_POSITION: COUNTS - 1,
    dxl.PRESENT_VOLTAGE: 120,
}
RESULT_FAIL, INSTRUCTION_ERROR, DATA_LENGTH, DATA_LIMIT, ACCESS = 1, 2, 5, 6, 7  # error numbers, e-Manual, Protocol 2.0
OVERHEATING = 4  # bit of the hardware error register
VELOCITY_COUNTS_S = 0.229 / 60.0 * COUNTS  # one unit of the velocity register
MOVES_COUNTS_S = 20.0  # assumption: above this speed the MOVING register is set


class Servo:
    """Emulated Dynamixel servo. Position is the encoder count plus the homing offset, beyond one turn where needed."""

    def __init__(self, id: int, motor: Motor, trouble: Trouble) -> None:
        self.id, self._motor, self._trouble = id, motor, trouble
        self._memory = Memory(SIZE, FACTORY | {dxl.ID: id})
        self._refresh()
        self._memory[dxl.GOAL_POSITION] = self._memory[dxl.PRESENT_POSITION]

    @property
    def delay_s(self) -> float:
        """Return delay before a reply [s]."""
        return self._memory[dxl.RETURN_DELAY] * TICK_S

    def tick(self, t_s: float) -> None:
        """Advance to t_s; on overheating disable torque, which stays disabled until a reboot."""
        self._motor.tick(t_s)
        if self._motor.degc > self._memory[TEMPERATURE_LIMIT]:
            self._memory[dxl.HARDWARE_ERROR] = OVERHEATING
            if self._memory[dxl.TORQUE_ENABLE]:
                self._memory[dxl.TORQUE_ENABLE] = 0
                self._motor.release()

    def power_on(self) -> None:
        """Restart with torque disabled and the goal at the present position."""
        self._refresh()
        self._memory[dxl.TORQUE_ENABLE] = 0
        self._memory[dxl.GOAL_POSITION] = self._memory[dxl.PRESENT_POSITION]
        self._motor.release()

    def obey(self, instruction: int, params: bytes) -> bytes:
        """Execute an instruction; return its status packet."""
        if "nack" in self._trouble:
            return self._status(RESULT_FAIL)
        if instruction == dxl.PING:
            return self._status(0, MODEL_XM430_W350.to_bytes(2, "little") + bytes((FIRMWARE,)))
        if instruction == dxl.READ and len(params) == 4:
            address, length = _words(params)
            return self.told(address, length)
        if instruction == dxl.WRITE and len(params) > 2:
            return self._status(self.write(_words(params[:2])[0], params[2:]))
        if instruction == REBOOT:
            self._memory[dxl.HARDWARE_ERROR] = self._memory[dxl.TORQUE_ENABLE] = 0
            self._motor.release()
            return self._status(0)
        return self._status(INSTRUCTION_ERROR)

    def told(self, address: int, length: int) -> bytes:
        """Return the status packet of a read."""
        if "nack" in self._trouble:
            return self._status(RESULT_FAIL)
        self._refresh()
        data = self._memory.read(address, length)
        return self._status(DATA_LENGTH) if data is None else self._status(0, data)

    def write(self, address: int, data: bytes) -> int:
        """Write all bytes and return 0, or write none and return the error number."""
        held, span = self._memory[dxl.TORQUE_ENABLE], range(address, address + len(data))
        if not span or span[-1] >= SIZE:
            return DATA_LENGTH
        if any(at in only for only in READ_ONLY for at in span) or (held and address < EEPROM):
            return ACCESS
        if dxl.TORQUE_ENABLE.address in span and data[dxl.TORQUE_ENABLE.address - address] and self._memory[dxl.HARDWARE_ERROR]:
            return RESULT_FAIL
        before = self._memory.read(address, len(data)) or b""
        self._memory.write(address, data)
        if dxl.GOAL_POSITION.address in span and not self._low <= self._memory.signed(dxl.GOAL_POSITION) <= self._high:
            self._memory.write(address, before)
            return DATA_LIMIT
        if self._memory[dxl.TORQUE_ENABLE]:
            self._drive()
        elif held:
            self._motor.release()
        return 0

    @property
    def _low(self) -> int:
        return self._memory.signed(dxl.MIN_POSITION)

    @property
    def _high(self) -> int:
        return self._memory.signed(dxl.MAX_POSITION)

    def _status(self, error: int, params: bytes = b"") -> bytes:
        alert = dxl.ALERT if self._memory[dxl.HARDWARE_ERROR] else 0
        return dxl.status(self.id, error | alert, params)

    def _drive(self) -> None:
        if self._memory[dxl.OPERATING_MODE] == 3:
            self._motor.drive(self._memory.signed(dxl.GOAL_POSITION) - self._memory.signed(dxl.HOMING_OFFSET))

    def _refresh(self) -> None:
        """Refresh the measured registers."""
        memory, motor = self._memory, self._motor
        speed = motor.counts_per_s
        memory[dxl.PRESENT_POSITION] = motor.count + memory.signed(dxl.HOMING_OFFSET)
        memory[dxl.PRESENT_VELOCITY] = round(speed / VELOCITY_COUNTS_S)
        memory[dxl.PRESENT_CURRENT] = round(motor.load * memory[CURRENT_LIMIT])
        memory[dxl.PRESENT_TEMPERATURE], memory[MOVING] = round(motor.degc), int(abs(speed) > MOVES_COUNTS_S)


def _words(data: bytes) -> tuple[int, ...]:
    return tuple(int.from_bytes(data[at : at + 2], "little") for at in range(0, len(data), 2))


class Dynamixel(Bus):
    """Emulated bus of Dynamixel servos, ids from 1."""

    def __init__(self, joints: Joints, trouble: Trouble) -> None:
        super().__init__({i + 1: Servo(i + 1, Motor(joints, i, trouble), trouble) for i in range(joints.count)}, trouble)
        self._packets = dxl.Packets()

    def _answer(self, data: bytes) -> bytes:
        return b"".join(self._execute(packet) for packet in self._packets.feed(data))

    def _execute(self, packet: dxl.Packet) -> bytes:
        p, instruction = packet.params, packet.instruction
        if instruction in (dxl.STATUS, dxl.SYNC_READ, dxl.SYNC_WRITE):
            return self._all(instruction, p) if instruction != dxl.STATUS and len(p) >= 4 else b""
        if packet.id != dxl.BROADCAST:
            return self._one(packet.id, instruction, p)
        replies = b"".join(self._one(id, instruction, p) for id in self._servos)
        return replies if instruction == dxl.PING else b""

    def _all(self, instruction: int, params: bytes) -> bytes:
        address, length = _words(params[:4])
        if instruction == dxl.SYNC_READ:
            return self._read_all(address, length, params[4:])
        self._write_all(address, length, params[4:])
        return b""
