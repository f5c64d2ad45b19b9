"""`calibrate`: source law, lag, offsets, R and Q from readings in clean air and at a source of known place."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from oio.api import array_input
from oio.api.calibration import Calibration
from oio.api.calibration_file import calibration_of
from oio.api.clean_air import baselines_of, columns
from oio.api.clock_offset import clock_offset, moved_earlier
from oio.api.left_out import sensible
from oio.api.location import fitting
from oio.api.path_stream import stream
from oio.api.samples import JointPath, NosePath, Readings
from oio.api.setup import Setup
from oio.core.errors import BadInput
from oio.core.records import Array, GasReading, nanoseconds, seconds
from oio.gas.bouts import Bout, ElementBaseline
from oio.gas.detection_rule import DetectionRule, Detector
from oio.gas.exposures import exposures
from oio.gas.signal_range import highest_signals
from oio.gas.timing import shift_path
from oio.gas.trace import Sniffs
from oio.inference.beacon_repeats import BeaconSurvey, type_b
from oio.inference.prior import calibrated_prior, cold_prior
from oio.inference.rise_and_fall import rise_and_fall
from oio.inference.uncertainty import TypeA, assemble_q_r, type_a_of_bouts
from oio.kinematics.arm import Arm
from oio.results import calibration as results
from oio.results.calibration_file import calibration_yaml
from oio.results.verdict import judge
from oio.runtime.gas_stream import GasStream, StreamGaps

CLOCK_U_S = 0.5  # of the offset between two devices that stamp one log: assumption
FARTHEST_BEACON_M = 5.0
OF_BOUTS = ("bout_detection",)  # criteria of the ladder of joints, which a nose that is moved by hand does not climb
PER_REPEAT, REPEATS = 5, 5  # measurements of a repeat, and repeats where nobody told when the nose stood still


def calibrate(
    readings: Readings, poses: JointPath, beacon_m: ArrayLike, *, clean_air_s: Sequence[float], beacon_s: Sequence[float],
    setup: Setup | None = None, measurement_ends_s: ArrayLike | None = None, beacon_u_m: float = 0.001, clock_u_s: float | None = None,
) -> Calibration:  # fmt: skip
    """Calibrate at one source of known place beacon_m (3,) [m], each axis known to `beacon_u_m`, along a path that holds all readings.

    `clean_air_s`, `beacon_s`: (begin, end) [s] of the readings before any gas, and while the beacon was open. `measurement_ends_s` (m,):
    when the nose left each place at which it sniffed, at least 10 of them: five measurements at a time locate the beacon again, which is
    the Type B uncertainty; None: 25 equal parts of `beacon_s`. `setup`: None is the SO-101 with five joints, or no arm for a `NosePath`,
    with the sensor `ec`. `clock_u_s` [s]: standard uncertainty of an offset between the stamps of readings and of poses, either way, for
    which the readings at the source are searched; 0: they have one clock; None: 0.5 for a `NosePath`, but for joints, and where the setup
    tells a delay (nominal.delay_s, delay_u_s), what that says. Takes some seconds. Warns
    (`oio.LeftOut`) of readings that are no measurement, and of single ones that the sensor cannot have given, and leaves them out.
    Raises BadInput for what does not fit together, NotObservable for too few readings.
    """
    array_input.expected("readings", readings, Readings, "oio.Readings(t_s, ppm=ppm)")
    array_input.expected("poses", poses, JointPath, "oio.NosePath(t_s, p_m)")
    array_input.expected("setup", setup, Setup, "oio.Setup(sensor='ec')", optional=True)
    setup = fitting(setup or Setup(), poses)
    arm, nominal = setup.robot, setup.part("nominal")
    clean, lit = array_input.span("clean_air_s", clean_air_s), array_input.span("beacon_s", beacon_s)
    if lit[0] < clean[1]:
        raise BadInput(
            f"beacon_s begins at {lit[0]:g} s, but clean_air_s ends at {clean[1]:g} s. Give clean air before the beacon was open."
        )
    _refuse_far(array_input.vector("beacon_m", beacon_m, 3), arm, poses)
    ends_s = _ends(measurement_ends_s, lit)
    measured = sensible([readings.between(*span) for span in (clean, lit)], setup)
    air, gas = ([r for r in measured if (seconds(r.t_ns) <= clean[1]) is early] for early in (True, False))
    baselines, noise_scale = baselines_of(air, setup)
    place = array_input.vector("beacon_m", beacon_m, 3), float(array_input.vector("beacon_u_m", [beacon_u_m])[0])
    offsets = np.array([b.ppm for b in baselines]), np.array([b.u_ppm for b in baselines])
    known = setup.part("range_law"), setup.part("process_noise"), setup.part("belief_map"), nominal
    survey = BeaconSurvey(arm, *known, place, offsets, noise_scale)
    sensed = _sensed(setup, poses, gas)
    if clock_u_s is None:
        told = nominal.delay_s or nominal.delay_u_s
        clock_u_s = CLOCK_U_S if isinstance(poses, NosePath) and not told else 0.0
    delay = clock_offset(survey, sensed, clock_u_s) if clock_u_s > 0.0 else survey.delay(sensed)
    if delay.s < 0.0:
        poses = moved_earlier(poses, -delay.s)
        gas = [reading for reading in gas if seconds(reading.t_ns) <= float(np.asarray(poses.t_s)[-1])]
        sensed = _sensed(setup, poses, gas)
    sniffs = shift_path(sensed, max(delay.s, 0.0))
    fit = survey.fit(sniffs)
    repeats = tuple(survey.repeat(sniffs, ends_s[b:], PER_REPEAT, fit) for b in range(0, len(ends_s) - PER_REPEAT, PER_REPEAT))
    rung = _type_a(gas, baselines, setup, len(ends_s) - 1)
    error_ppm = float(np.hypot(rung.u_a_effective_ppm, np.linalg.norm(offsets[1]) / len(baselines)))
    gaps, box_sd_m = _gaps(gas), arm.box_sd_m
    lags = rise_and_fall(survey.problem(sniffs), fit)
    fired = exposures(_detector(baselines, setup), sensed, ends_s, _near(sensed, setup.robot, place[0], ends_s))
    found = results.MapCalibration(
        fit, repeats, type_b(repeats), nanoseconds(lit[1]), error_ppm, len(ends_s) - 1, delay, gaps, box_sd_m, lags, fired,
        highest_signals(sensed, baselines), None,
    )  # fmt: skip
    base = results.BaselineResult(baselines, noise_scale, nanoseconds(clean[0]))
    text = _text(setup, found, rung, base, isinstance(poses, NosePath))
    return calibration_of(text, "the calibration", setup)


def _refuse_far(beacon_m: Array, arm: Arm, poses: JointPath) -> None:
    """Refuse a beacon so far from the path that it is in other units, or in another frame."""
    nearest_m = float(np.min(np.linalg.norm(arm.nose(np.asarray(poses.q)) - beacon_m, axis=1)))
    if nearest_m > FARTHEST_BEACON_M:
        raise BadInput(
            f"beacon_m is {beacon_m.tolist()}, {nearest_m:.3g} m from the nearest place of the nose, where no gas of it would be smelt. "
            f"Give metres, in the frame of the poses."
        )


def _sensed(setup: Setup, poses: JointPath, gas: list[GasReading]) -> Sniffs:
    trace = setup.part("belief_map").trace()
    for sensed in stream(poses, gas):
        trace.add(sensed)
    found: Sniffs = trace.as_arrays()
    return found


def _near(sensed: Sniffs, arm: Arm, beacon_m: Array, ends_s: list[float]) -> list[bool]:
    """Whether the nose was near the beacon at the end of each measurement: within half of its farthest distance."""
    q = np.array([np.interp(ends_s[1:], sensed.t_s, joint) for joint in sensed.q.T]).T
    distances = np.linalg.norm(arm.nose(q) - beacon_m, axis=1)
    return [bool(near) for near in distances <= 0.5 * np.max(distances)]


def _detector(baselines: tuple[ElementBaseline, ...], setup: Setup) -> Detector:
    rule: DetectionRule = setup.part("bout")
    return rule.detector(rule.window(setup.robot.dof), baselines)


def _ends(given: ArrayLike | None, lit: tuple[float, float]) -> list[float]:
    """Begin of the first measurement and ends of all."""
    if given is None:
        return [float(t_s) for t_s in np.linspace(*lit, REPEATS * PER_REPEAT + 1)]
    ends = array_input.times("measurement_ends_s", given)
    if len(ends) < 2 * PER_REPEAT or ends[0] <= lit[0] or ends[-1] > lit[1]:
        raise BadInput(
            f"measurement_ends_s has {len(ends)} times from {ends[0]:g} to {ends[-1]:g} s, but {2 * PER_REPEAT} or more after the begin of "
            f"beacon_s and not after its end are wanted, {lit[0]:g} to {lit[1]:g} s. Leave it out if the nose never stood still."
        )
    return [lit[0], *ends.tolist()]


def _type_a(gas: list[GasReading], baselines: tuple[ElementBaseline, ...], setup: Setup, moves: int) -> TypeA:
    dof = setup.robot.dof
    k = setup.part("bout").window(dof)
    detector, steps = _detector(baselines, setup), list[Bout]()
    for reading in gas:
        bout = detector.feed(reading)
        steps += [] if bout is None else [bout]
    return type_a_of_bouts(dof, k, steps, float(np.median(np.diff(columns(gas)[0]))), setup.part("nominal").rise_s, moves)


def _gaps(readings: list[GasReading]) -> StreamGaps:
    seen = GasStream()
    for reading in readings:
        seen.arrived(reading.t_ns)
    return seen.gaps()


def _text(setup: Setup, found: results.MapCalibration, rung: TypeA, base: results.BaselineResult, by_hand: bool) -> str:
    law, walks, nominal = setup.part("range_law"), setup.part("process_noise"), setup.part("nominal")
    noises = {name: assemble_q_r(name, rung.u_a_ppm, found.type_b) for name in ("gum", "paper")}
    late = replace(nominal, delay_s=max(found.delay.s, 0.0))
    chosen, paper = (calibrated_prior(found.fit, setup.robot, walks, late, noises[name]) for name in ("gum", "paper"))
    cold, cold_open = (cold_prior(setup.robot, law, walks, nominal, pinned) for pinned in (True, False))
    calibration = results.Calibration(
        chosen, paper, cold, cold_open, noises["gum"], seconds(found.ended_ns - base.began_ns), found.error_ppm, rung.u_a_ppm,
        found.type_b.u_b_m, found.moves, base.elements, found.highest_ppm,
    )  # fmt: skip
    criteria = setup.part("verdict")
    kept = {name: criterion for name, criterion in criteria.criteria.items() if not (by_hand and name in OF_BOUTS)}
    verdict = judge({results.BaselineResult: base, results.MapCalibration: found}, replace(criteria, criteria=kept))
    held = {"sensor": setup.nose.name, "serial": None, "arm": setup.robot.name, "profile": setup.profile, "air": "unknown"}
    made: dict[str, object] = {"started": None, "devices": {}}
    bouts = results.BoutCalibration((rung,), setup.part("belief_map").trace(), 0.0)
    return calibration_yaml(calibration, bouts, found, noises, held, made, verdict, found.ended_ns)
