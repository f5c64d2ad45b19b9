"""`locate`: readings and poses in, source and covariance out, with other places that explain the readings, and a verdict in words."""

import re
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from oio.api.array_input import expected
from oio.api.calibration import Calibration, chosen_setup, prior_of
from oio.api.clock_offset import moved_earlier
from oio.api.left_out import sensible
from oio.api.path_stream import fed
from oio.api.samples import JointPath, NosePath, Readings
from oio.api.setup import MARGIN_M, Setup
from oio.core.errors import BadInput
from oio.core.records import Array
from oio.estimators.odometry import Odometry
from oio.inference.map_fit import Fit
from oio.inference.observability import unobservable
from oio.kinematics.arm import Arm
from oio.results.criteria.judgement import RECALIBRATE, WARN, WORDS, Judgement, Verdict
from oio.results.evaluation import Evaluation, Findings, Outcome, Place, Scored
from oio.results.verdict import judge

COLD: tuple[str, ...] = (
    "There was no calibration: lag, gain and noise are those of data sheets, and may be off by factors. Calibrate, see oio.calibrate.",
)
OWN_WORDS = {  # what the reader of a log does, who has no stage and no key of a run
    re.escape(RECALIBRATE): "Calibrate in the air, and with the sensor, of these readings.",
    r"\braise stage\.navigate\.max_moves": "sniff longer",
    r"\bRaise stage\.navigate\.max_moves": "Sniff longer",
    r" \(stage\.[\w.]+\)": "",
}
BY_HAND = {  # what can be done with a nose that has no joints
    r"Use more joints \(dof\), or tell": "Sniff all around it, and near, or tell",
    r" with dof=\d+": "",
    r", or use more joints": "",
}
BEYOND_RAD = 0.5  # joints of a log may be beyond the model's limits by an error of their zeros
OF_CALIBRATION = "calibration: "  # before what the calibration says of itself
NOT_JUDGED = ("declared",)  # criteria of a search that goes on by itself


@dataclass(frozen=True, eq=False)
class Location:
    """Where the source is: mean_m (3,) and cov_m2 (3, 3) of the best place; the same of `others` that explain the readings as well; what
    `world` the best assumes; and the verdict on it, PASS, WARN or FAIL by what a bench can see, with `reasons` in sentences."""

    mean_m: Array
    cov_m2: Array
    others: tuple[tuple[Array, Array], ...]
    world: str
    verdict: str
    reasons: tuple[str, ...]

    @property
    def sd_m(self) -> float:
        """Root of the trace of the covariance [m]."""
        return float(np.sqrt(np.trace(self.cov_m2)))

    @classmethod
    def of(cls, odometry: Odometry, setup: Setup, calibration: Calibration | None) -> Self:
        """Return that of an odometry that has just made a map. Its verdict is at best that of the calibration; without one WARN."""
        best, *others = odometry.hypotheses
        source = odometry.source()
        assert source is not None
        verdict = _judged(odometry, setup)
        before, told = WARN, COLD
        if calibration is not None:
            before, told = calibration.verdict, tuple(f"{OF_CALIBRATION}{own_words(reason)}" for reason in calibration.reasons)
        word, reasons = max(verdict.word, before, key=WORDS.index), (*told, *verdict.reasons)
        places = tuple((np.array(fit.source), np.array(fit.source_cov)) for fit in others)
        return cls(np.array(source[0]), np.array(source[1]), places, best.world, word, reasons)


def locate(
    readings: Readings, poses: JointPath, calibration: Calibration | None = None, *, setup: Setup | None = None,
    box_m: ArrayLike | None = None, measurements: int = 1, assembly: str = "gum",
) -> Location:  # fmt: skip
    """Locate one source that stands still, from readings along a path that holds their times, by a fit of all of them.

    `calibration`: of this sensor in this air; None: data sheets and nominal models, and `setup` is needed. `box_m` (2, 3) [m]: lower and
    upper corner of where the source may be; None: the arm's workspace box, or of a `NosePath` its extent and 0.3 m around.
    `measurements`: places at which the nose sniffed, by which the calibration's Type B uncertainty goes down; 1 is on the safe side.
    `assembly` of Q and R: gum or paper. Warns (`oio.LeftOut`) of readings that are no measurement, and of single ones that
    the sensor cannot have given, and leaves them out. Raises BadInput for what does not fit together, NotObservable for fewer than two
    readings.
    """
    expected("readings", readings, Readings, "oio.Readings(t_s, ppm=ppm)")
    expected("poses", poses, JointPath, "oio.NosePath(t_s, p_m)")
    setup = fitting(chosen_setup(calibration, setup), poses)
    arm = _arm_in_box(setup, poses, box_m)
    if calibration is not None and calibration.delay_s < 0.0:
        poses = moved_earlier(poses, -calibration.delay_s)
        readings = readings.between(*(float(np.asarray(poses.t_s)[i]) for i in (0, -1)))
    odometry = Odometry(setup.part("ekf"), prior_of(calibration, setup, arm, assembly), setup.part("belief_map"))
    fed(odometry, poses, sensible([readings], setup))
    odometry.locate(measurements)
    return Location.of(odometry, setup, calibration)


def fitting(setup: Setup, poses: JointPath) -> Setup:
    """Return the setup for a path: without an arm for a nose path. Raises BadInput for another number of joints."""
    if isinstance(poses, NosePath):
        return setup.without_arm()
    columns = np.asarray(poses.q).shape[1]
    if columns != setup.dof:
        given = f"JointPath.q has the shape {np.asarray(poses.q).shape}, but the setup has dof={setup.dof}"
        raise BadInput(f"{given}: (k, {setup.dof}) is wanted. Give oio.Setup(dof={columns}), or a NosePath if these are nose positions.")
    _refuse_degrees(setup.robot, np.asarray(poses.q))
    return setup


def _refuse_degrees(arm: Arm, q: Array) -> None:
    """Refuse joints (k, n) that are far beyond the arm's limits, and within them if they are degrees."""
    turns = np.array([unit == "rad" for unit in arm.units])
    low, high = arm.low_rad[: arm.dof][turns] - BEYOND_RAD, arm.high_rad[: arm.dof][turns] + BEYOND_RAD
    angles = q[:, turns]
    beyond, as_degrees = (angles < low) | (angles > high), np.radians(angles)
    if np.any(beyond) and np.all((as_degrees >= low) & (as_degrees <= high)):
        raise BadInput(
            f"JointPath.q has {angles[beyond][0]:g} rad, far beyond the limits of arm '{arm.name}', but as degrees all are within them. "
            f"Give radians, e.g. with numpy's radians."
        )


def _arm_in_box(setup: Setup, poses: JointPath, box_m: ArrayLike | None) -> Arm:
    if box_m is None and isinstance(poses, NosePath):
        p = np.asarray(poses.q)
        return setup.boxed([p.min(axis=0) - MARGIN_M, p.max(axis=0) + MARGIN_M])
    return setup.robot if box_m is None else setup.boxed(box_m)


def _judged(odometry: Odometry, setup: Setup) -> Verdict:
    best, *others = odometry.hypotheses
    arm = odometry.prior.model.arm
    unseen = unobservable(odometry.trace.as_arrays(), odometry.prior, odometry.hypotheses, setup.number("stage.evaluate.narrowed"))
    (believed, sd), others_at = _at(best), tuple(Place(*_at(fit), fit.world, None) for fit in others)
    found = replace(_NOTHING, believed_m=believed, sd_m=sd, world=best.world, other_places=others_at, nis_mean=odometry.mean_nis())
    judged = Evaluation(
        found,
        found,
        found,
        None,
        None,
        None,
        None,
        Findings(best.residuals, unseen, arm.dof, arm.box_sd_m, 0, 0),
        Scored("unknown", ()),
        None,
        0.0,
    )
    criteria = setup.part("verdict")
    kept = {name: criterion for name, criterion in criteria.criteria.items() if name not in NOT_JUDGED}
    by_hand = setup.arm == "gantry"
    return Verdict(tuple(_in_own_words(j, by_hand) for j in judge({Evaluation: judged}, replace(criteria, criteria=kept)).judgements))


def _in_own_words(judgement: Judgement, by_hand: bool) -> Judgement:
    return replace(judgement, found=own_words(judgement.found, by_hand), action=own_words(judgement.action, by_hand))


def own_words(text: str, by_hand: bool = False) -> str:
    """Advice without the keys of a run; `by_hand`: to somebody whose nose has no joints."""
    for words, own in {**OWN_WORDS, **(BY_HAND if by_hand else {})}.items():
        text = re.sub(words, own, text)
    return text


def _at(fit: Fit) -> tuple[tuple[float, ...], float]:
    return tuple(map(float, fit.source)), float(np.sqrt(np.trace(fit.source_cov)))


_NOTHING = Outcome(None, None, None, None, None, None, 0, 0.0, False, None, None, None)
