"""Registers and bits against tables that others typed. Drivers and emulators share our tables: what is wrong in one is wrong in both, and
no run over an emulated wire would notice."""

import pytest

from hardware.codecs import dynamixel, scd4x, sts
from hardware.codecs.line import Lines
from hardware.drivers.noses import scd30

STS3215 = {  # lerobot, motors/feetech/tables.py, which cites Feetech's STS/SMS e-manual
    "MODEL": (3, 2), "ID": (5, 1), "BAUD": (6, 1), "RETURN_DELAY": (7, 1), "MIN_POSITION": (9, 2), "MAX_POSITION": (11, 2),
    "MAX_TEMPERATURE": (13, 1), "P": (21, 1), "D": (22, 1), "I": (23, 1), "HOMING_OFFSET": (31, 2), "MODE": (33, 1),
    "TORQUE_ENABLE": (40, 1), "ACCELERATION": (41, 1), "GOAL_POSITION": (42, 2), "GOAL_VELOCITY": (46, 2), "TORQUE_LIMIT": (48, 2),
    "LOCK": (55, 1), "PRESENT_POSITION": (56, 2), "PRESENT_VELOCITY": (58, 2), "PRESENT_LOAD": (60, 2), "PRESENT_VOLTAGE": (62, 1),
    "PRESENT_TEMPERATURE": (63, 1), "STATUS": (65, 1), "MOVING": (66, 1), "PRESENT_CURRENT": (69, 2),
}  # fmt: skip
X_SERIES = {  # lerobot, motors/dynamixel/tables.py, which cites ROBOTIS's e-manual of the X series
    "MODEL": (0, 2), "ID": (7, 1), "BAUD": (8, 1), "RETURN_DELAY": (9, 1), "OPERATING_MODE": (11, 1), "HOMING_OFFSET": (20, 4),
    "MAX_POSITION": (48, 4), "MIN_POSITION": (52, 4), "TORQUE_ENABLE": (64, 1), "HARDWARE_ERROR": (70, 1), "GOAL_CURRENT": (102, 2),
    "GOAL_VELOCITY": (104, 4), "PROFILE_ACCELERATION": (108, 4), "PROFILE_VELOCITY": (112, 4), "GOAL_POSITION": (116, 4),
    "PRESENT_CURRENT": (126, 2), "PRESENT_VELOCITY": (128, 4), "PRESENT_POSITION": (132, 4), "PRESENT_VOLTAGE": (144, 2),
    "PRESENT_TEMPERATURE": (146, 1),
}  # fmt: skip


@pytest.mark.parametrize(("module", "table"), [(sts, STS3215), (dynamixel, X_SERIES)])
def test_every_register_is_where_others_have_it(module, table):
    ours = {name: tuple(value) for name, value in vars(module).items() if isinstance(value, module.Register)}
    assert ours == table


def test_the_scd30s_registers():
    """Of the interface description v1.0; the frames of three are in test_vectors.py."""
    assert (scd30.FIRMWARE, scd30.INTERVAL, scd30.READY, scd30.VALUES, scd30.START) == (0x20, 0x25, 0x27, 0x28, 0x36)


def test_a_servos_complaints_are_its_makers_bits():
    sdk = pytest.importorskip("scservo_sdk.protocol_packet_handler", reason="not installed: pip install oio[oracles]")
    ours = (sts.VOLTAGE_ERROR, sts.ANGLE_ERROR, sts.OVERHEAT, sts.OVERCURRENT, sts.OVERLOAD)
    assert ours == (sdk.ERRBIT_VOLTAGE, sdk.ERRBIT_ANGLE, sdk.ERRBIT_OVERHEAT, sdk.ERRBIT_OVERELE, sdk.ERRBIT_OVERLOAD)


def test_the_longest_transfer_fills_a_frame():
    assert len(scd4x.transceive(scd4x.ADDRESS, bytes(scd4x.MOST_TX), 0, 1)) == 255


def test_a_sentence_that_the_silence_cut_short_is_counted():
    lines = Lines()
    assert lines.feed(b"$NOSE,12") == [] and lines.flush() == []
    assert (lines.corrupt, lines.skipped) == (1, 8)
    assert lines.flush() == [] and lines.corrupt == 1
