"""The command line of `python -m oio.localise`."""

import sys
from collections.abc import Sequence

import numpy as np
from rich.console import Console

from oio.api.calibrate import calibrate
from oio.api.calibration import Calibration
from oio.api.calibration_file import load_calibration
from oio.api.location import locate
from oio.api.log_file import LogFile, read_log
from oio.api.samples import JointPath, NosePath, Readings
from oio.api.setup import Setup
from oio.cli.exit_codes import VERDICT_FAILED, run_command
from oio.cli.first_compile import first_compile
from oio.core.errors import BadInput
from oio.localise.asked import Asked, asked
from oio.localise.display import save, show
from oio.localise.found import Found
from oio.results.criteria.judgement import FAIL

HELP = """usage: python -m oio.localise LOG KEY=VALUE ...

Where the source is, from the log of a nose that was moved: a table (CSV and its kind, .gz, Parquet), or an MCAP log of any program. The
log says where the nose was (nose_columns), or the joints of the arm that carried it (joint_columns); times are seconds since it began.

  python -m oio.localise walk.csv sensor=ndir nose_columns=[x,y,z] position_unit=mm
  python -m oio.localise walk.csv sensor=ndir nose_columns=[x,y,z] position_unit=mm clean_air_s=[0,20] \\
      beacon_m=[0.1,0.05,0] beacon_s=[20,140] out=found
  python -m oio.localise other.csv nose_columns=[x,y,z] position_unit=mm calibration=found/calibration.yaml
  python -m oio.localise arm.mcap arm=ur5e joint_columns=[/joint_states.position.shoulder_pan_joint,...] position_unit=rad sensor=ndir

of the log:
  nose_columns=  joint_columns=  position_unit=    where the nose was: [x,y,z] in m, mm or cm; or joints, base first, in rad or deg
  columns=, time=, unit=, per_ppm= ...             readings and times, where they are not read off the file: keys of
                                                   conf/recording/csv.yaml; `python -m oio.inspect LOG` writes them
of the search:
  sensor=  arm=  profile=                          choices of conf/, see `python -m oio.run --help`
  search_s=[BEGIN,END]                             readings to be used; without it all, or all after the beacon
  box_m=[[X,Y,Z],[X,Y,Z]]                          lower and upper corner of where the source may be, in metres
  calibration=FILE                                 calibration.yaml of this sensor in this air
  clean_air_s=  beacon_m=  beacon_s=               or a calibration by the log itself: clean air, then a source of known place
  out=FOLDER                                       location.json, location.png and calibration.yaml there; a new folder
  KEY=VALUE                                        any other key of conf/, e.g. nominal.rise_s=4.0

exit code: 0 done, 2 bad input, 3 the verdict is FAIL, 130 stopped
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Localise in one log; returns the exit code."""
    words = sys.argv[1:] if arguments is None else list(arguments)
    if {"--help", "-h"} & set(words):
        sys.stdout.write(HELP)
        return 0
    words_of_verdict: list[str] = []
    code = run_command(lambda: words_of_verdict.append(_run(asked(words))))
    return VERDICT_FAILED if code == 0 and words_of_verdict == [FAIL] else code


def _run(given: Asked) -> str:
    """Localise, print and write; returns the word of the verdict."""
    if given.out and given.out.exists():
        raise BadInput(f"{given.out} is there already, and results are never overwritten. Give another name to out=.")
    console = Console(stderr=True)
    with console.status("reading the log"):
        log = read_log(given.file, sigma_ppm=None, **given.mapping)
        path = _path(log)
        kept = load_calibration(given.calibration) if given.calibration else None
        setup = kept.setup if kept else _setup(given, path)
    first_compile()  # after what may be refused
    with console.status("calibrating"):
        calibration = _calibrated(given, setup, log, path) if given.calibrates else kept
    with console.status("localising"):
        readings = _readings(given, log, path)
        box_m = given.places.get("box_m")
        own = setup if calibration is None else None  # a calibration has its own
        where = None if readings is None else locate(readings, path, calibration, setup=own, box_m=box_m)
    found = Found(log, path, readings, setup, calibration, where)
    show(given, found)
    if given.out:
        save(given, found, given.out)
    return where.verdict if where else calibration.verdict if calibration else ""


def _path(log: LogFile) -> JointPath:
    if log.path is None:
        raise BadInput(
            "nothing says where the nose was. Type nose_columns=[X,Y,Z], the names of the columns, or joint_columns=[...] of an arm; "
            "`python -m oio.inspect LOG` lists the columns."
        )
    return log.path


def _setup(given: Asked, path: JointPath) -> Setup:
    dof = {} if isinstance(path, NosePath) else {"dof": np.asarray(path.q).shape[1]}
    return Setup(**given.chosen, **dof, overrides=given.overrides)  # type: ignore[arg-type]  # choices are text, dof is none of them


def _calibrated(given: Asked, setup: Setup, log: LogFile, path: JointPath) -> Calibration:
    """The calibration by the log itself."""
    clean, lit = given.spans["clean_air_s"], given.spans["beacon_s"]
    return calibrate(_on_path(log.readings, path), path, given.places["beacon_m"], clean_air_s=clean, beacon_s=lit, setup=setup)


def _readings(given: Asked, log: LogFile, path: JointPath) -> Readings | None:
    """The readings to search by; None if the log ends with the beacon."""
    readings = _on_path(log.readings, path)
    if span := given.spans.get("search_s"):
        return readings.between(*span)
    begin_s = given.spans["beacon_s"][1] if given.calibrates else None
    last_s = float(np.asarray(readings.t_s)[-1])
    return readings if begin_s is None else readings.between(begin_s, last_s) if begin_s < last_s else None


def _on_path(readings: Readings, path: JointPath) -> Readings:
    """The readings at whose time the place of the nose is known."""
    t_s = np.asarray(path.t_s)
    return readings.between(float(np.nextafter(t_s[0], -np.inf)), float(t_s[-1]))
