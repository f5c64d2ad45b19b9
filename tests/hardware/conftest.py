"""The firmware of the nose, compiled, and the simulated board that it runs on."""

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

FIRMWARE = Path(__file__).resolve().parents[2] / "hardware" / "firmware" / "nose"
BOARD = Path(__file__).parent / "firmware"
PACKAGES = "gcc make gcc-avr avr-libc libsimavr-dev libelf-dev"


def _skip_without(*tools: str) -> None:
    missing = [tool for tool in tools if shutil.which(tool) is None and not Path(tool).is_file()]
    if missing:
        pytest.skip(f"no {', '.join(missing)}: apt-get install {PACKAGES}")


@pytest.fixture(scope="session")
def built_firmware(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The ELF, made with these flags besides; a warning is an error."""

    _skip_without("make", "avr-gcc", "avr-objcopy", "avr-size", "avr-nm")

    def build(flags: str) -> Path:
        folder = tmp_path_factory.mktemp("firmware")
        subprocess.run(["make", "-C", FIRMWARE, f"BUILD={folder}", f"EXTRA=-Werror {flags}"], check=True, capture_output=True, text=True)
        return folder / "nose.elf"

    return build


@pytest.fixture(scope="session")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tool that runs an ELF on a simulated microcontroller; see firmware/host.c."""
    _skip_without("gcc", "/usr/include/simavr/sim_avr.h", "/usr/include/libelf.h")
    out = tmp_path_factory.mktemp("host") / "host"
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-I/usr/include/simavr"]
    subprocess.run(["gcc", *flags, "-o", out, *sorted(BOARD.glob("*.c")), "-lsimavr", "-lelf", "-lutil"], check=True)
    return out


@pytest.fixture(scope="session")
def elf(built_firmware: Callable[[str], Path]) -> Path:
    """The firmware as it is flashed."""
    return built_firmware("")
