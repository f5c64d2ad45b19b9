"""`OIO/Search-v0`: find a source with a calibrated nose; an action is one measuring move."""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike

from oio.bench.episode import Episode, begun, checked_benches, words_of, world_seed
from oio.core.errors import BadInput, OioError
from oio.core.records import Array
from oio.gym.arrays import Floats, as_floats, checked_action, finite_number, refuse_ended, space_of
from oio.gym.search_reward import worth_of
from oio.results.calibration import Calibration
from oio.search.closed_loop import ClosedLoop
from oio.search.exploration import explore
from oio.search.loop_settings import LoopSettings
from oio.search.observation import observe, shapes
from oio.search.targets import box_goal, source_goal
from oio.search.view import View

GOALS = {"box": box_goal, "source": source_goal}
Outcome = tuple[dict[str, Floats], float, bool, bool, dict[str, Any]]


class SearchEnv(gymnasium.Env[dict[str, Floats], Floats]):
    """Search for a source: the simulation, filter, belief maps and stopping rule of `python -m oio.run`, goals by the agent.

    `sensor`, `dof`, `air`, `arm`, `profile`, `overrides`: as the words of the command line, overrides={"stage.navigate.max_moves": 40}.
    `bench_seeds`: seeds of the benches, each calibrated once per process and kept; `reset` takes one of them and draws source, turbulence
    and noise anew. None: every episode calibrates its own bench, and is the run of that seed.

    Action, Box(-1, 1, (3,)): where the nose goes next. `frame` "box": a place in the workspace box. "source": from the believed source, in
    units of 0.15 of the box's diagonal; without a belief the arm explores as search=d_optimal does, which is no step of the agent. The
    nose keeps its limits and its distance from the believed source: it goes as near as it may. Sniffs that the search itself asks for
    (between hypotheses, elsewhere) are made within a step.

    Observation, Dict of Box(-1, 1): what the robot knows, see `oio.search.observation.observe`; never the truth.

    Reward: nats gained by the belief (`reward` "information": by its covariance alone; "log_score": by its density at the true place),
    less `second_cost` per second; `declared` nats for a source that is declared, with "log_score" negative if it is more than three
    stop.sd_m off. Terminated when the source is declared, truncated after stage.navigate.max_moves or max_s, or if the arm is stopped.

    `info`: moves, seconds, sd_m, declared, and under `truth` what no agent may use: source_m (3,), error_m; each once it is known.
    """

    metadata = {"render_modes": []}  # noqa: RUF012  # as gymnasium has it

    def __init__(
        self, sensor: str = "ec", dof: int = 5, air: str = "still", arm: str = "so101", profile: str = "paper",
        overrides: Mapping[str, object] | None = None, frame: str = "box", reward: str = "information", second_cost: float = 0.02,
        declared: float = 2.0, bench_seeds: Sequence[int] | None = (0, 1, 2, 3),
    ) -> None:  # fmt: skip
        if frame not in GOALS:
            raise BadInput(f"frame is {frame!r}, but it can be {' or '.join(GOALS)}. Type frame='box'.")
        self._words = words_of(sensor, dof, air, arm, profile, overrides)
        self._frame, self._worth, self._judged = frame, worth_of(reward), reward == "log_score"
        self._second_cost, self._declared = finite_number("second_cost", second_cost), finite_number("declared", declared)
        self._bench_seeds = checked_benches(bench_seeds)
        self.observation_space = space_of(shapes(dof))
        self._over = True  # or not begun
        self.action_space = spaces.Box(-1.0, 1.0, (3,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict[str, Floats], dict[str, Any]]:
        """Begin on a calibrated bench with a new source; options={"world_seed": n} begins that very episode."""
        super().reset(seed=seed)
        number = world_seed(options, int(self.np_random.integers(2**31)))
        bench, self._episode = begun(self._words, self._bench_seeds, number, "navigate")
        settings, calibration = bench.experiment.stages["navigate"], self._episode.context.need(Calibration)
        assert isinstance(settings, LoopSettings)
        self._settings = settings
        with self._episode.attended():
            self._loop = ClosedLoop(settings, self._episode.context, calibration.chosen, calibration.baselines)
            self._advance()
        self._over = False
        return self._observation(), self._info()

    def step(self, action: ArrayLike) -> Outcome:
        """Make the move of an action (3,), and those that the search itself asks for."""
        refuse_ended(self._over)
        wanted, before, began_s, failure = checked_action(action), self._value(), self._loop.spent_s, ""
        with self._episode.attended():
            try:
                goal = GOALS[self._frame](self._view, wanted, self._episode.context.rng)
                self._loop.move(self._episode.permitted(goal))
                self._advance()
            except OioError as error:  # the guard has stopped the arm
                failure = str(error)
        gain = self._value() - before - self._second_cost * (self._loop.spent_s - began_s)
        declared = self._loop.declared
        over = bool(failure) or self._loop.over
        self._over = over or declared
        info = self._info() | ({"failure": failure} if failure else {})
        return self._observation(), gain + self._bonus(), declared, over and not declared, info

    @property
    def view(self) -> View:
        """What a strategy would see now."""
        return self._view

    @property
    def episode(self) -> Episode:
        """The episode, with its random numbers."""
        return self._episode

    @property
    def loop(self) -> ClosedLoop:
        """The search."""
        return self._loop

    def _advance(self) -> None:
        """Make the moves that are not the agent's; the last word of a search that ends is that of a map of everything."""
        loop, context = self._loop, self._episode.context
        self._view = loop.view()
        while not loop.over:
            goal = loop.asked(self._view)
            if goal is None and (self._frame == "box" or self._view.belief is not None):
                return
            loop.move(self._episode.permitted(explore(self._view, context.rng) if goal is None else goal))
            self._view = loop.view()
        loop.finish()
        self._view = loop.view()

    def _value(self) -> float:
        return self._worth(self._loop.odometry.source(), self._truth_m(), self._settings.arm)

    def _bonus(self) -> float:
        if not self._loop.declared:
            return 0.0
        wrong = self._judged and self._error_m() > 3.0 * self._settings.stop.sd_m
        return -self._declared if wrong else self._declared

    def _truth_m(self) -> Array | None:
        truth = self._episode.log.truth
        return None if truth is None else truth.source_m

    def _error_m(self) -> float:
        source, truth_m = self._loop.odometry.source(), self._truth_m()
        return float("nan") if source is None or truth_m is None else float(np.linalg.norm(source[0] - truth_m))

    def _observation(self) -> dict[str, Floats]:
        return as_floats(observe(self._view))

    def _info(self) -> dict[str, Any]:
        source, truth_m = self._loop.odometry.source(), self._truth_m()
        sd_m = float("inf") if source is None else float(np.sqrt(np.trace(source[1])))
        truth: dict[str, Any] = {} if truth_m is None else {"source_m": np.array(truth_m)}
        truth |= {} if source is None else {"error_m": self._error_m()}
        return {
            "moves": len(self._loop.moves),
            "seconds": self._loop.spent_s,
            "sd_m": sd_m,
            "declared": self._loop.declared,
            "truth": truth,
        }
