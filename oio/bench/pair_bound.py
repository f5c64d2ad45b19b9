"""`python -m oio.bench pair_bound`: Cramer-Rao bound of the source for boards with two elements, on the same paths; seconds, not hours.

It is the filter's own model of the gas that says what a board can tell; `python -m oio.bench stereo` says what it tells in simulated air.
"""

import itertools
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from oio.bench.arguments import read
from oio.bench.boards import BOARDS
from oio.bench.output_folder import claim_folder
from oio.bench.trial import composed_trial
from oio.cli import terminal
from oio.cli.csv_file import names, write
from oio.cli.table_layout import print_table
from oio.core.errors import BadInput
from oio.core.records import Array
from oio.core.seeds import Seeds
from oio.gas.fluctuation import Fluctuation
from oio.gas.trace import Sniffs
from oio.inference.bounds import cramer_rao
from oio.inference.prior import Prior, nominal_prior
from oio.inference.state_space import StateSpace
from oio.inference.uncertainty import Noise
from oio.kinematics.arm import Arm
from oio.kinematics.minimum_jerk import minimum_jerk
from oio.sweep.bootstrap import interval

TABLE = "pair_bound.csv"
STEP_S, MOVE_S, NEAR_M = 0.05, 1.0, (0.05, 0.12)  # of the path; every other pose is so near to the source
LN_STRENGTH = 4.2  # of 70 ppm at 10 cm, as the electrochemical cells' source in still air
CALIBRATED = {"exponent_u": 0.05, "wind_per_m_u": 0.5, "lift_per_m_u": 0.3, "thinning_per_m_u": 0.3}  # what a beacon leaves open
CALIBRATED_GAIN_U, CALIBRATED_TAU_U, CALIBRATED_OFFSET_U_PPM = 0.05, 0.05, 0.05


@dataclass(frozen=True, slots=True)
class Row:
    """Bounds of one board over the paths; `ratio` is the median of its bound over that of the first board, with a 95 % interval."""

    gamma: float  # standard deviation of the concentration over its mean, by fluctuation
    board: str
    paths: int
    median_mm: float
    ratio: float
    ratio_low: float
    ratio_high: float


def run(arguments: list[str]) -> None:
    """Run the command: bounds and table."""
    words = read("pair_bound", arguments)
    boards, gammas, poses = words.several("board"), [float(g) for g in words.several("gamma")], words.whole("poses", 4)
    if set(boards) - set(BOARDS):
        raise BadInput(f"board={words.own['board']} was given, but a board is one of {', '.join(BOARDS)}. Type e.g. board={BOARDS[0]}.")
    spacing_m, dwell_s, seeds = words.number("spacing_m"), words.number("dwell_s"), words.wholes("seeds")
    _, built = composed_trial((f"sensor={words.own['sensor']}", "dof=5", *words.overrides))
    stage: Any = built.stages["map_beliefs"]
    out = claim_folder(words.own["out"], "pair_bound", (TABLE,))
    paths = [_Path.drawn(stage.arm, Seeds(truth=seed, disturbance=seed, measurement=seed), poses, dwell_s) for seed in seeds]
    found = {
        (gamma, board): np.array([_bound_mm(stage, path, board, spacing_m, gamma) for path in paths])
        for gamma, board in itertools.product(gammas, boards)
    }
    rows = [_row(gamma, board, mm, found[gamma, boards[0]]) for (gamma, board), mm in found.items()]
    write(out / TABLE, names(Row), map(asdict, rows))
    cells = [(f"{r.gamma:g}", r.board, str(r.paths), f"{r.median_mm:.1f}", _ratio(r)) for r in rows]
    heads = ("gamma", "board", "paths", "bound [mm]\nmedian", "over that of\nthe first")
    print_table(terminal.console(), "Cramer-Rao bound of the source; brackets are 95 % intervals", heads, cells, 2)
    terminal.console(soft_wrap=True).print(f"the table is in {out}", markup=False)


def _row(gamma: float, board: str, mm: Array, first: Array) -> Row:
    ratio = mm / first
    return Row(gamma, board, len(mm), float(np.median(mm)), float(np.median(ratio)), *interval(ratio, np.median))


def _ratio(r: Row) -> str:
    return f"{r.ratio:.2f} [{r.ratio_low:.2f}, {r.ratio_high:.2f}]"


@dataclass(frozen=True, eq=False)
class _Path:
    """Source (3,) m, times (k,) s and joints (k, n) rad of a path about it."""

    source: Array
    t_s: Array
    q: Array

    @staticmethod
    def drawn(arm: Arm, seeds: Seeds, poses: int, dwell_s: float) -> "_Path":
        """Poses anywhere and near the source, in turn, a second to get to each."""
        rng = seeds.rng("truth", "pair bound")
        source = rng.uniform([0.22, -0.2, 0.1], [0.42, 0.2, 0.28])
        goals = [arm.home, *(_pose(arm, source, rng, near=i % 2 == 1) for i in range(poses))]
        t = np.arange(0.0, poses * (MOVE_S + dwell_s), STEP_S)
        leg = np.minimum((t / (MOVE_S + dwell_s)).astype(int), poses - 1)
        share = np.array([minimum_jerk(min(x / MOVE_S, 1.0)) for x in t - leg * (MOVE_S + dwell_s)])
        q = np.array([goals[i] + s * (goals[i + 1] - goals[i]) for i, s in zip(leg, share, strict=True)])
        return _Path(source, t, q)

    def sniffs(self, sampling: str, sample_s: float, sigma_ppm: float) -> Sniffs:
        """Readings of both elements on the path; their values matter to the bound only where the lag begins."""
        at = np.arange(0, len(self.t_s), max(round(sample_s / STEP_S), 1))
        at = np.repeat(at, 2) if sampling == "together" else at
        element: NDArray[np.int64] = np.arange(len(at)) % 2
        ppm, sigma = np.full(len(at), 1.0), np.full(len(at), sigma_ppm)
        return Sniffs(self.t_s, self.q, at, self.t_s[at], element, ppm, sigma, np.zeros(len(at), dtype=np.bool_))


def _pose(arm: Arm, source: Array, rng: np.random.Generator, near: bool) -> Array:
    q = arm.random_pose(rng)
    while near or np.linalg.norm(arm.nose(q) - source) < NEAR_M[0]:
        direction = rng.standard_normal(3)
        goal = source + rng.uniform(*NEAR_M) * direction / np.linalg.norm(direction)
        found = arm.solve_ik(goal, arm.random_pose(rng))
        if found is not None:
            return np.asarray(found)
    return q


def _bound_mm(stage: Any, path: _Path, board: str, spacing_m: float, gamma: float) -> float:
    """Root of the trace of the bound [mm]."""
    places, _, sampling = board.partition("_")
    arm = replace(stage.arm, element_spacing_m=spacing_m if places == "two" else 0.0)
    nominal = replace(stage.nominal, gain_u=CALIBRATED_GAIN_U, tau_u=CALIBRATED_TAU_U)
    law = replace(stage.range_law, **CALIBRATED)
    law = replace(law, nose_jitter_m=law.typical_nose_jitter_m, model_discrepancy=law.typical_model_discrepancy)
    mean, cov = nominal_prior(arm, law, nominal, np.full(2, nominal.background_ppm), np.full(2, CALIBRATED_OFFSET_U_PPM))
    gas, gain = Fluctuation(1.0, gamma, law.eddy_s), (1.0, 1.0)
    model = StateSpace(arm, law, stage.process_noise, nominal.rise_s, nominal.fall_s, gain, gas, nominal.sigma_ppm, Noise.nominal())
    theta = mean.copy()
    theta[:3], theta[3] = path.source, LN_STRENGTH
    sniffs = path.sniffs(sampling, stage.sensor.sample_s, nominal.sigma_ppm)
    return 1e3 * cramer_rao(sniffs, Prior(mean, cov, model), theta).rms_m
