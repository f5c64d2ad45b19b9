"""`python -m oio.doctor [--json]`: is this computer ready? Versions, disk, clock, serial ports and their rights, and a short run."""

import sys
from collections.abc import Iterator

from oio.core import startup
from oio.core.standard_output import ended

startup.handle_signals(__name__)

from hydra.utils import instantiate
from omegaconf import OmegaConf

from oio.cli.exit_codes import run_command
from oio.core.arguments import CommandParser
from oio.core.folders import CONF, ROOT
from oio.doctor.finding import FAIL, Check, Finding
from oio.doctor.report import show, to_json, worst

FAILED = 3
CODES = "exit code: 0 nothing fails (warnings may), 3 something fails, 2 bad input"


def main(arguments: list[str] | None = None) -> int:
    """Make all checks of conf/doctor.yaml and print what they find; returns the exit code."""
    parser = CommandParser(example="--json", prog="python -m oio.doctor", description=__doc__, epilog=CODES)
    parser.add_argument("--json", action="store_true", help="for machines: schema oio.doctor/1")
    given = parser.parse_args(arguments)
    findings = list[Finding]()
    code = run_command(lambda: _report(findings, given.json))
    return FAILED if not code and worst(findings) == FAIL else code


def _report(findings: list[Finding], as_json: bool) -> None:
    for check in _checks():
        findings.append(check.check())
        if not as_json:
            show(findings[-1])
    if as_json:
        sys.stdout.write(to_json(findings))


def _checks() -> Iterator[Check]:
    sys.path.insert(0, str(ROOT))  # the checks of devices are in `hardware`, beside `oio`
    for node in OmegaConf.load(CONF / "doctor.yaml").values():
        yield instantiate(node)


if __name__ == "__main__":
    sys.exit(ended(main))
