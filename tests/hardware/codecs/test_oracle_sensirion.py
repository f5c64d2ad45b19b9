"""Sensirion's own stack against our SHDLC and SCD4x: its host talks to our device side, frame by frame and as a whole."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware.codecs import scd4x, shdlc

WHY = "an oracle of SHDLC is not installed: pip install oio[oracles]"
shdlc_driver = pytest.importorskip("sensirion_shdlc_driver", reason=WHY)
bridge = pytest.importorskip("sensirion_shdlc_sensorbridge", reason=WHY)
vendor = pytest.importorskip("sensirion_i2c_scd4x.device", reason=WHY)
commands = pytest.importorskip("sensirion_i2c_scd4x.commands", reason=WHY)
results = pytest.importorskip("sensirion_i2c_scd4x.result_types", reason=WHY)
i2c = pytest.importorskip("sensirion_i2c_driver", reason=WHY)
adapters = pytest.importorskip("sensirion_driver_adapters.i2c_adapter.i2c_channel", reason=WHY)
frames = pytest.importorskip("sensirion_shdlc_driver.serial_frame_builder", reason=WHY)

BYTE, WORD = st.integers(0, 255), st.integers(0, 65535)
DATA = st.binary(max_size=255) | st.lists(st.sampled_from((0x7E, 0x7D, 0x11, 0x13, 0x5E)), max_size=255).map(bytes)
CRC8 = i2c.CrcCalculator(8, 0x31, 0xFF)
ONE = bridge.SensorBridgePort.ONE


def read_by_vendor(raw: bytes) -> shdlc.Frame | None:
    builder = frames.ShdlcSerialMisoFrameBuilder()
    try:
        return shdlc.Frame(*builder.interpret_data()) if builder.add_data(raw) else None
    except shdlc_driver.errors.ShdlcResponseError:
        return None


@given(address=BYTE, command=BYTE, data=DATA)
def test_frames_from_the_host(address, command, data):
    raw = frames.ShdlcSerialMosiFrameBuilder(address, command, data).to_bytes()
    assert shdlc.mosi(address, command, data) == raw
    assert shdlc.Mosi().feed(raw) == [shdlc.Frame(address, command, 0, data)]


@given(frame=st.builds(shdlc.Frame, BYTE, BYTE, BYTE, DATA))
def test_frames_from_the_device(frame):
    raw = shdlc.miso(frame.address, frame.command, frame.state, frame.data)
    assert read_by_vendor(raw) == frame
    content = bytes((frame.address, frame.command, frame.state, len(frame.data))) + frame.data
    content += bytes((frames.ShdlcSerialFrameBuilder._calculate_checksum(content),))
    made = b"\x7e" + bytes(frames.ShdlcSerialMosiFrameBuilder._stuff_data_bytes(content)) + b"\x7e"
    assert made == raw and shdlc.Miso().feed(made) == [frame]


@given(frame=st.builds(shdlc.Frame, BYTE, BYTE, BYTE, st.binary(max_size=12)), data=st.data())
def test_we_read_nothing_that_they_refuse(frame, data):
    raw = bytearray(shdlc.miso(frame.address, frame.command, frame.state, frame.data))
    for _ in range(data.draw(st.integers(1, 2))):
        raw[data.draw(st.integers(1, len(raw) - 2))] = data.draw(BYTE.filter(lambda byte: byte != 0x7E))
    assert shdlc.Miso().feed(bytes(raw)) in ([], [read_by_vendor(bytes(raw))])


@given(st.lists(WORD, max_size=6))
def test_words_and_their_crc(words):
    raw = b"".join(word.to_bytes(2, "big") + bytes((CRC8(word.to_bytes(2, "big")),)) for word in words)
    assert scd4x.packed(words) == raw
    stripped = adapters.I2cChannel.strip_and_check_crc(bytearray(scd4x.packed(words)), CRC8)
    assert (stripped or b"") == b"".join(word.to_bytes(2, "big") for word in words)
    assert scd4x.unpacked(raw) == tuple(words)


@given(WORD, WORD, WORD)
def test_what_words_mean(ppm, temperature, humidity):
    theirs = (results.SignalCo2Concentration(ppm), results.SignalTemperature(temperature), results.SignalRelativeHumidity(humidity))
    assert scd4x.measured((ppm, temperature, humidity)) == pytest.approx(tuple(signal.value for signal in theirs), abs=1e-9)


COMMANDS = {
    "START": "StartPeriodicMeasurement",
    "READ": "ReadMeasurementRaw",
    "STOP": "StopPeriodicMeasurement",
    "READY": "GetDataReadyStatusRaw",
    "SERIAL": "GetSerialNumber",
    "VARIANT": "GetSensorVariantRaw",
    "SINGLE_SHOT": "MeasureSingleShot",
    "FORCED_RECALIBRATION": "PerformForcedRecalibration",
    "SELF_CALIBRATION": "SetAutomaticSelfCalibrationEnabled",
    "PRESSURE": "SetAmbientPressureRaw",
    "SELF_TEST": "PerformSelfTest",
    "REINIT": "Reinit",
}


@pytest.mark.parametrize(("name", "theirs"), COMMANDS.items())
def test_the_commands(name, theirs):
    assert getattr(scd4x, name) == getattr(commands, theirs).CMD_ID


@pytest.mark.parametrize("name", ["SCD40", "SCD41", "SCD43"])
def test_the_variants(name):
    assert getattr(scd4x, name) == commands.SensorVariant[name].value
    assert commands.SensorVariant.MASK.value == scd4x.VARIANT_MASK


class Bench:
    """The vendor's host on a wire, our bridge and sensor behind it."""

    def __init__(self, wire, words: dict[int, tuple[int, ...]], state: int = 0) -> None:
        self.frames, self.asked, self.words, self.state, self._framer = [], [], words, state, shdlc.Mosi()
        self.wire = wire(self._answer)
        port = shdlc_driver.ShdlcSerialPort("wire", 460800, additional_response_time=0.0, do_open=False)
        port._serial = self.wire
        self.bridge = bridge.SensorBridgeShdlcDevice(shdlc_driver.ShdlcConnection(port), slave_address=0)
        proxy = i2c.I2cConnection(bridge.SensorBridgeI2cProxy(self.bridge, ONE))
        self.sensor = vendor.Scd4xDevice(adapters.I2cChannel(proxy, slave_address=0x62, crc=CRC8))

    def _answer(self, data: bytes) -> bytes:
        return b"".join(self._reply(frame) for frame in self._framer.feed(data))

    def _reply(self, frame: shdlc.Frame) -> bytes:
        self.frames.append(frame)
        transfer = scd4x.transfer(frame.data) if frame.command == scd4x.TRANSCEIVE else None
        asked = scd4x.commanded(transfer.tx) if transfer else None
        self.asked.append((transfer, asked))
        rx = scd4x.packed(self.words.get(asked[0], ())) if asked else b""
        return shdlc.miso(frame.address, frame.command, self.state, rx[: transfer.rx_len] if transfer else b"")


def test_a_measurement_through_the_whole_stack(wire):
    bench = Bench(wire, {scd4x.READ: (500, 0x6667, 0x5EB9), scd4x.READY: (0x8006,), scd4x.SERIAL: (1, 2, 3), scd4x.VARIANT: (0x1440,)})
    bench.sensor.start_periodic_measurement()
    assert bench.sensor.get_data_ready_status()
    assert [signal.value for signal in bench.sensor.read_measurement()] == pytest.approx(scd4x.measured((500, 0x6667, 0x5EB9)))
    assert bench.sensor.get_serial_number() == 0x000100020003
    assert bench.sensor.get_sensor_variant() == commands.SensorVariant.SCD41
    bench.sensor.set_ambient_pressure(101300)
    sent = [asked for _, asked in bench.asked]
    assert (sent[0], sent[-1]) == ((scd4x.START, ()), (scd4x.PRESSURE, (1013,)))
    assert (scd4x.READ, ()) in sent and (scd4x.READY, ()) in sent
    assert {(transfer.port, transfer.i2c_address) for transfer, _ in bench.asked} == {(0, scd4x.ADDRESS)}
    ours = [shdlc.mosi(0, scd4x.TRANSCEIVE, scd4x.transceive(t.i2c_address, t.tx, t.rx_len, t.timeout_us, t.port)) for t, _ in bench.asked]
    assert bench.wire.sent == b"".join(ours)


@settings(max_examples=50)
@given(address=st.integers(0, 127), tx=st.binary(min_size=2, max_size=20), timeout_us=st.integers(0, 10**6))
def test_a_transfer(wire, address, tx, timeout_us):
    bench = Bench(wire, {})
    bench.bridge.transceive_i2c(ONE, address, tx, 0, timeout_us)
    assert bench.wire.sent == shdlc.mosi(0, scd4x.TRANSCEIVE, scd4x.transceive(address, tx, 0, timeout_us))


@pytest.mark.parametrize(("state", "error"), [(shdlc.NACK, "SensorBridgeI2cNackError"), (shdlc.I2C_TIMEOUT, "SensorBridgeI2cTimeoutError")])
def test_the_states(wire, state, error):
    with pytest.raises(getattr(bridge.device_errors, error)):
        Bench(wire, {}, state).bridge.transceive_i2c(ONE, 0x62, b"\xec\x05", 9, 1000)


def test_the_bridge_s_own_commands(wire):
    bench = Bench(wire, {})
    bench.bridge.set_supply_voltage(ONE, 3.3)
    bench.bridge.switch_supply_on(ONE)
    bench.bridge.set_i2c_frequency(ONE, 100e3)
    expected = [
        (scd4x.SET_VOLTAGE, bytes((0, scd4x.VOLTS_3V3))),
        (scd4x.SUPPLY, b"\x00\x01"),
        (scd4x.I2C_FREQUENCY, bytes((0, scd4x.KHZ_100))),
    ]
    assert [(frame.command, frame.data) for frame in bench.frames] == expected
    assert bench.wire.sent == b"".join(shdlc.mosi(0, command, data) for command, data in expected)
