"""Which serial ports there are, and what they look like by their USB ids."""

from collections.abc import Iterable

from serial.tools import list_ports

from hardware.transport.discovery import port_name
from oio.core.settings import settings
from oio.doctor.finding import PASS, WARN, Finding


@settings
class Ports:
    """Names by USB vendor, four hexadecimal digits."""

    vendors: dict[str, str]

    def check(self) -> Finding:
        """WARN if there is no port."""
        return self.judge((info.device, port_name(info)) for info in list_ports.comports())

    def judge(self, ports: Iterable[tuple[str, str]]) -> Finding:
        """Judge ports, each a path and a name as `port_name` gives it."""
        seen = [f"{path} ({self.looks_like(name)})" for path, name in ports]
        if not seen:
            action = "Only a bench needs one: plug in its cables. Without parts: python -m hardware.emulate."
            return Finding("ports", WARN, "none that the system lists", action)
        return Finding("ports", PASS, f"{', '.join(seen)}; python -m hardware.ports asks each who it is")

    def looks_like(self, name: str) -> str:
        """Name a port by its USB vendor; one without stays as the system names it."""
        vendor = name.removeprefix("usb:").partition(":")[0]
        return f"{self.vendors[vendor]}, {name}" if vendor in self.vendors else name
