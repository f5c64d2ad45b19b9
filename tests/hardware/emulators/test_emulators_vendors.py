"""The vendors' own stacks at the ports of our emulators: they take them for the devices that they were written for."""

import contextlib
import time
from pathlib import Path

import pytest

from hardware.codecs import dynamixel, sts
from hardware.emulators import options
from hardware.emulators.emulated_bench import emulate_bench

KEYS = Path(__file__).resolve().parents[3] / "conf" / "emulate.yaml"
WHY = "a vendor's stack is not installed: pip install oio[oracles]"
PATIENT_S = 2.0  # a busy host
HOME = 2048  # of a joint at 0 rad


@pytest.fixture
def up(built, tmp_path):
    """up(nose="scd30"): names of the ports of a running bench."""

    @contextlib.contextmanager
    def made(**own):
        chosen, overrides = options.read([f"{key}={value}" for key, value in {"out": tmp_path, "valve": "none", **own}.items()], KEYS)
        with emulate_bench(chosen, built("backend", "air=steady", "dof=3", "seed=1", *overrides)) as bench, bench.loop.running():
            yield {name: str(path) for name, path in bench.ports.items()}

    return made


def heard(ask, *errors):
    """What it answers in the end: at first nobody may listen yet, and a value may not be there."""
    until = time.monotonic() + 10.0
    while True:
        try:
            return ask()
        except errors:
            if time.monotonic() > until:
                raise
            time.sleep(0.05)


def test_minimalmodbus_reads_an_scd30(up):
    minimalmodbus = pytest.importorskip("minimalmodbus", reason=WHY)
    with up(nose="scd30", arm="none") as ports:
        host = minimalmodbus.Instrument(ports["nose"], 0x61)
        host.serial.baudrate, host.serial.timeout = 19_200, PATIENT_S
        try:
            assert heard(lambda: host.read_register(0x20), minimalmodbus.NoResponseError) == 0x0342
            host.write_register(0x25, 5, functioncode=6)
            assert host.read_register(0x25) == 5
            assert heard(lambda: 1 // host.read_register(0x27), ZeroDivisionError) == 1
            ppm, degc, rh = (host.read_float(register) for register in (0x28, 0x2A, 0x2C))
            assert 0.0 < ppm < 2000.0 and (degc, rh) == (25.0, 50.0)
            with pytest.raises(minimalmodbus.SlaveReportedException):
                host.write_register(0x25, 1, functioncode=6)
        finally:
            host.serial.close()


def test_sensirions_stack_reads_an_scd41(up):
    shdlc = pytest.importorskip("sensirion_shdlc_driver", reason=WHY)
    bridges = pytest.importorskip("sensirion_shdlc_sensorbridge", reason=WHY)
    i2c = pytest.importorskip("sensirion_i2c_driver", reason=WHY)
    scd4x = pytest.importorskip("sensirion_i2c_scd4x.device", reason=WHY)
    channels = pytest.importorskip("sensirion_driver_adapters.i2c_adapter.i2c_channel", reason=WHY)
    with up(nose="scd41", arm="none") as ports, shdlc.ShdlcSerialPort(ports["nose"], 460_800, PATIENT_S) as port:
        bridge = bridges.SensorBridgeShdlcDevice(shdlc.ShdlcConnection(port), slave_address=0)
        assert heard(bridge.get_product_name, shdlc.errors.ShdlcTimeoutError) == "SEK-SensorBridge"
        assert bridge.get_version().firmware.major == 1
        bridge.set_i2c_frequency(bridges.SensorBridgePort.ONE, 100_000)
        bridge.set_supply_voltage(bridges.SensorBridgePort.ONE, 3.3)
        bridge.switch_supply_on(bridges.SensorBridgePort.ONE)
        transceiver = i2c.I2cConnection(bridges.SensorBridgeI2cProxy(bridge, port=bridges.SensorBridgePort.ONE))
        sensor = scd4x.Scd4xDevice(channels.I2cChannel(transceiver, slave_address=0x62, crc=i2c.CrcCalculator(8, 0x31, 0xFF)))
        assert str(sensor.get_sensor_variant()).endswith("SCD41")
        assert sensor.get_serial_number() == 0xF8969F073BBE
        sensor.start_periodic_measurement()
        assert heard(lambda: 1 // int(sensor.get_data_ready_status()), ZeroDivisionError) == 1
        ppm, degc, rh = (signal.value for signal in sensor.read_measurement())
        assert 0 < ppm < 2000 and (round(degc, 1), round(rh, 1)) == (25.0, 50.0)
        sensor.stop_periodic_measurement()


def servo_port(sdk, path):
    port = sdk.PortHandler(path)
    port.openPort()
    port.setBaudRate(1_000_000)
    port.setPacketTimeout = lambda length: port.setPacketTimeoutMillis(1e3 * PATIENT_S)  # theirs is for a quick host
    return port


def test_feetechs_sdk_moves_servos(up):
    sdk = pytest.importorskip("scservo_sdk", reason=WHY)
    with up(arm="feetech") as ports:
        port, host = servo_port(sdk, ports["arm"]), sdk.PacketHandler(0)
        try:
            assert heard(lambda: {0: host.ping(port, 1)[0]}[host.ping(port, 1)[1]], KeyError) == sts.STS3215_MODEL
            before, result, error = host.read2ByteTxRx(port, 1, 56)
            assert (result, error) == (0, 0) and abs(before - HOME) < 10
            assert host.write2ByteTxRx(port, 1, 42, before + 100) == (0, 0)
            assert host.write1ByteTxRx(port, 1, 40, 1) == (0, 0)
            assert heard(lambda: 1 // (abs(host.read2ByteTxRx(port, 1, 56)[0] - before - 100) < 8), ZeroDivisionError) == 1
            sync = sdk.GroupSyncRead(port, host, 56, 6)
            for id in range(1, 6):
                sync.addParam(id)
            assert sync.txRxPacket() == 0 and all(sync.isAvailable(id, 56, 2) for id in range(1, 6))
        finally:
            port.closePort()


def test_dynamixels_sdk_moves_servos(up):
    sdk = pytest.importorskip("dynamixel_sdk", reason=WHY)
    with up(arm="dynamixel") as ports:
        port, host = servo_port(sdk, ports["arm"]), sdk.PacketHandler(2.0)
        try:
            assert heard(lambda: {0: host.ping(port, 1)[0]}[host.ping(port, 1)[1]], KeyError) == 1020
            before, result, error = host.read4ByteTxRx(port, 1, dynamixel.PRESENT_POSITION.address)
            assert (result, error) == (0, 0) and abs(before - HOME) < 10
            assert host.write4ByteTxRx(port, 1, dynamixel.GOAL_POSITION.address, before + 100) == (0, 0)
            assert host.write1ByteTxRx(port, 1, dynamixel.TORQUE_ENABLE.address, 1) == (0, 0)
            position = dynamixel.PRESENT_POSITION.address
            assert heard(lambda: 1 // (abs(host.read4ByteTxRx(port, 1, position)[0] - before - 100) < 8), ZeroDivisionError) == 1
            found, result = host.broadcastPing(port)
            assert result == 0 and sorted(found) == [1, 2, 3, 4, 5]
        finally:
            port.closePort()
