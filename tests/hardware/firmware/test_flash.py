"""`make flash` with avrdude itself, against a bootloader that speaks STK500 (Atmel AVR061), as an Arduino's does."""

import os
import select
import subprocess
import threading
import tty

import pytest

from tests.hardware.conftest import FIRMWARE, skip_without

IN_SYNC, OK, END = 0x14, 0x10, 0x20
SIGNATURE = bytes((0x1E, 0x95, 0x0F))  # ATmega328P
PAGE, FLASH_BYTES = 128, 32 * 1024
LENGTHS = {0x30: 2, 0x41: 3, 0x42: 22, 0x50: 2, 0x51: 2, 0x55: 4, 0x56: 6, 0x74: 5, 0x75: 2}  # of commands, with their END


class Bootloader:
    """On a pty; `flash` is what was written, `done` whether it was told to leave."""

    def __init__(self) -> None:
        self.flash, self.done, self._at, self._said = bytearray(b"\xff" * FLASH_BYTES), False, 0, b""
        self._fd, self._far = os.openpty()
        tty.setraw(self._far)
        self.path, self._leave = os.ttyname(self._far), threading.Event()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._leave.set()
        self._thread.join()
        os.close(self._fd)
        os.close(self._far)

    def _listen(self) -> None:
        while not self._leave.is_set():
            if select.select([self._fd], [], [], 0.1)[0]:
                self._said += os.read(self._fd, 4096)
                while self._said and len(self._said) >= (n := self._length()):
                    command, self._said = self._said[:n], self._said[n:]
                    assert command[-1] == END, command.hex()
                    os.write(self._fd, bytes((IN_SYNC, *self._answer(command), OK)))

    def _length(self) -> int:
        first = self._said[0]
        if first == 0x45 and len(self._said) > 1:  # extended device: its second byte counts itself and what follows
            return 2 + self._said[1]
        if first == 0x64 and len(self._said) > 2:  # a page
            return 5 + int.from_bytes(self._said[1:3], "big")
        return LENGTHS.get(first, 5)

    def _answer(self, command: bytes) -> bytes:
        if command[0] == 0x55:
            self._at = 2 * int.from_bytes(command[1:3], "little")  # words
        elif command[0] == 0x64:
            assert command[3:4] == b"F" and self._at % PAGE == 0
            self.flash[self._at : self._at + len(command) - 5] = command[4:-1]
        elif command[0] == 0x74:
            return bytes(self.flash[self._at : self._at + int.from_bytes(command[1:3], "big")])
        elif command[0] == 0x51:
            self.done = True
        return {0x41: b"\x04", 0x56: b"\x00", 0x75: SIGNATURE}.get(command[0], b"")


@pytest.fixture
def board():
    made = Bootloader()
    yield made
    made.close()


def test_make_flash_writes_the_firmware_and_reads_it_back(board, built_firmware):
    skip_without("avrdude")
    elf = built_firmware("")
    command = ["make", "-C", FIRMWARE, f"BUILD={elf.parent}", "flash", f"PORT={board.path}"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 0 and "verified" in run.stderr, run.stderr
    subprocess.run(["avr-objcopy", "-O", "binary", "-R", ".eeprom", elf, elf.with_suffix(".bin")], check=True)
    image = elf.with_suffix(".bin").read_bytes()
    assert board.done and bytes(board.flash[: len(image)]) == image and len(image) > 1000


def test_make_flash_asks_for_the_port(built_firmware):
    command = ["make", "-C", FIRMWARE, f"BUILD={built_firmware('').parent}", "flash"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode != 0 and "which port? Type e.g. make flash PORT=/dev/ttyUSB0" in run.stdout
