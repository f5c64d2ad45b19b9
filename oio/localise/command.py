"""The command line of `python -m oio.localise`."""

import shutil
import sys
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from oio.api.calibrate import CLOCK_U_S, calibrate
from oio.api.calibration import Calibration
from oio.api.calibration_file import load_calibration
from oio.api.left_out import LeftOut
from oio.api.location import locate
from oio.api.log_file import LogFile, read_log
from oio.api.samples import JointPath, NosePath, Readings
from oio.api.setup import Setup
from oio.cli import terminal
from oio.cli.exit_codes import VERDICT_FAILED, run_command
from oio.cli.first_compile import first_compile
from oio.core.errors import BadInput
from oio.localise.asked import Asked, asked
from oio.localise.display import save, show
from oio.localise.found import Found
from oio.results.criteria.judgement import FAIL
from oio.tabular.positions import outside

LAGS = 3.0  # after which a sensor has forgotten what it smelt where nobody knows
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
  positions=FILE                                   where they are in another file, stamped by the same clock
  columns=, time=, unit=, per_ppm= ...             readings and times, where they are not read off the file: keys of
                                                   conf/recording/csv.yaml; `python -m oio.inspect LOG` writes them
of the search:
  sensor=  arm=  profile=                          choices of conf/, see `python -m oio.run --help`
  search_s=[BEGIN,END]                             readings to be used; without it all, or all after the beacon
  box_m=[[X,Y,Z],[X,Y,Z]]                          lower and upper corner of where the source may be, in metres
  calibration=FILE                                 calibration.yaml of this sensor in this air
  clean_air_s=  beacon_m=  beacon_s=               or a calibration by the log itself: clean air, then a source of known place
  clock_u_s=                                       how far the stamps of gas and positions may be apart in s (standard uncertainty, 0.5);
                                                   the calibration finds by how much they are; 0: they have one clock
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
    if given.out:
        _make(given.out)
        given.out.rmdir()  # until there is something to put there: a stop leaves nothing
    console = terminal.console(stderr=True)
    with console.status("reading the log"):
        log = read_log(given.file, None, given.positions, **given.mapping)
        path = _path(log)
        kept = load_calibration(given.calibration) if given.calibration else None
        setup = kept.setup if kept else _setup(given, path)
    first_compile()  # after what may be refused
    with console.status("calibrating"), warnings.catch_warnings(record=True) as of_calibration:
        warnings.simplefilter("always", LeftOut)
        readings = _known(log, path, setup)
        calibration = _calibrated(given, setup, readings, path) if given.calibrates else kept
    with console.status("localising"), warnings.catch_warnings(record=True) as of_search:
        warnings.simplefilter("always", LeftOut)
        searched = _searched(given, readings)
        box_m = given.places.get("box_m")
        own = setup if calibration is None else None  # a calibration has its own
        where = None if searched is None else locate(searched, path, calibration, setup=own, box_m=box_m)
    log = replace(log, notes=(*log.notes, *(str(one.message) for one in (*of_calibration, *of_search) if one.category is LeftOut)))
    found = Found(log, path, searched, setup, calibration, where)
    show(given, found)
    if given.out:
        _save(given, found, given.out)
    return where.verdict if where else calibration.verdict if calibration else ""


def _make(out: Path) -> None:
    try:
        out.mkdir(parents=True)
    except FileExistsError:
        raise BadInput(f"{out} is there already, and results are never overwritten. Give another name to out=.") from None
    except OSError as error:
        raise BadInput(f"out={out} cannot be made ({error.strerror}). Give another folder.") from None


def _save(given: Asked, found: Found, out: Path) -> None:
    """Write all results, or none: a full disk or a stop leaves nothing that would be in the way of the next try."""
    _make(out)
    try:
        save(given, found, out)
    except (OSError, KeyboardInterrupt):
        shutil.rmtree(out, ignore_errors=True)
        raise


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


def _known(log: LogFile, path: JointPath, setup: Setup) -> Readings:
    """The readings whose gas is of known places: on the path, in no hole of it, and not within so many lags after one."""
    readings, nominal = log.readings, setup.part("nominal")
    t_s = np.asarray(path.t_s)
    on_path = readings.between(float(np.nextafter(t_s[0], -np.inf)), float(t_s[-1]))
    known = outside(np.asarray(on_path.t_s), log.holes_s, LAGS * max(nominal.rise_s, nominal.fall_s))
    return on_path.only(known)


def _calibrated(given: Asked, setup: Setup, readings: Readings, path: JointPath) -> Calibration:
    """The calibration by the log itself."""
    clean, lit = given.spans["clean_air_s"], given.spans["beacon_s"]
    told = any(key.startswith("nominal.delay") for key in given.overrides)
    clock_u_s = given.clock_u_s if given.clock_u_s is not None or told else CLOCK_U_S
    return calibrate(readings, path, given.places["beacon_m"], clean_air_s=clean, beacon_s=lit, setup=setup, clock_u_s=clock_u_s)


def _searched(given: Asked, readings: Readings) -> Readings | None:
    """The readings to search by; None if the log ends with the beacon."""
    if span := given.spans.get("search_s"):
        return readings.between(*span)
    begin_s = given.spans["beacon_s"][1] if given.calibrates else None
    last_s = float(np.asarray(readings.t_s)[-1])
    return readings if begin_s is None else readings.between(begin_s, last_s) if begin_s < last_s else None
