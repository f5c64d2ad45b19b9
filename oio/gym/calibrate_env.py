"""`OIO/Calibrate-v0`: learn sensor and air at a source of known place; an action is the next measurement."""

from collections.abc import Mapping, Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike

from oio.bench.episode import begun, checked_benches, words_of, world_seed
from oio.core.errors import BadInput, OioError
from oio.core.interfaces import Sensor
from oio.core.records import Array, GasReading, seconds
from oio.gym.arrays import Floats, as_floats, checked_action, finite_number, refuse_ended, space_of
from oio.gym.beacon_poses import beacon_target_m, pose_near
from oio.gym.beacon_survey import BeaconStage, Survey, shapes
from oio.results.calibration import BaselineResult
from oio.runtime.context import sniff

Outcome = tuple[dict[str, Floats], float, bool, bool, dict[str, Any]]


class CalibrateEnv(gymnasium.Env[dict[str, Floats], Floats]):
    """Calibration at the beacon, after warm-up and baseline: the simulation and the fit of `python -m oio.run`, poses by the agent.

    `sensor`, `dof`, `air`, `arm`, `profile`, `overrides`, `bench_seeds`: as of `OIO/Search-v0`; a bench here is a sensor that is warm.

    Action, Box(-1, 1, (3,)): where the nose measures next, from the beacon, in units of 0.22 of the workspace box's diagonal. The arm
    goes to the allowed pose nearest to that, off the beacon.

    Observation, Dict of Box(-1, 1): see `oio.gym.beacon_survey.Survey.observe`; the beacon's place is known, all else is estimated.

    Reward: nats by which the measurement narrowed the fit of everything but the beacon's place, less `second_cost` per second.
    Terminated when the calibration's time is spent (stage.map_beliefs.budget_s), truncated after `max_moves` or if the arm is stopped.

    `info`: moves, seconds, known_nats.
    """

    metadata = {"render_modes": []}  # noqa: RUF012  # as gymnasium has it

    def __init__(
        self, sensor: str = "ec", dof: int = 5, air: str = "still", arm: str = "so101", profile: str = "paper",
        overrides: Mapping[str, object] | None = None, second_cost: float = 0.0, max_moves: int = 60,
        bench_seeds: Sequence[int] | None = (0, 1, 2, 3),
    ) -> None:  # fmt: skip
        if not isinstance(max_moves, int) or max_moves < 1:
            raise BadInput(f"max_moves is {max_moves!r}, but it is a whole number, 1 at least. Type max_moves=60.")
        self._words = words_of(sensor, dof, air, arm, profile, overrides)
        self._second_cost, self._max_moves = finite_number("second_cost", second_cost), max_moves
        self._bench_seeds = checked_benches(bench_seeds)
        self.observation_space = space_of(shapes(dof))
        self._over = True  # or not begun
        self.action_space = spaces.Box(-1.0, 1.0, (3,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[dict[str, Floats], dict[str, Any]]:
        """Begin with a warm sensor and an open beacon; options={"world_seed": n} begins that very episode."""
        super().reset(seed=seed)
        number = world_seed(options, int(self.np_random.integers(2**31)))
        bench, self._episode = begun(self._words, self._bench_seeds, number, "calibrate_bouts")
        self._stage = cast(BeaconStage, bench.experiment.stages["map_beliefs"])
        self._sensor: Sensor = bench.experiment.sensor
        base = self._episode.context.need(BaselineResult)
        self._survey, self._began_ns = Survey(self._stage, base), base.began_ns
        with self._episode.attended():
            self._episode.guarded.present("beacon")
        self._over = False
        return self._observation(), self._info()

    def step(self, action: ArrayLike) -> Outcome:
        """Measure at the pose of an action (3,), and fit everything measured so far."""
        refuse_ended(self._over)
        wanted, before, began_s, failure = checked_action(action), self._survey.known_nats, self._spent_s(), ""
        with self._episode.attended():
            try:
                self._measure(wanted)
            except OioError as error:  # the guard has stopped the arm, or there are not readings enough
                failure = str(error)
        gain = self._survey.known_nats - before - self._second_cost * (self._spent_s() - began_s)
        spent = self._spent_s() >= self._stage.budget_s
        over = bool(failure) or len(self._survey.poses) >= self._max_moves
        self._over = over or spent
        return self._observation(), gain, spent, over and not spent, self._info() | ({"failure": failure} if failure else {})

    @property
    def stage(self) -> BeaconStage:
        """The stage whose settings hold."""
        return self._stage

    @property
    def goal(self) -> Array:
        """The goal (n,) rad of the last move."""
        return self._episode.guarded.goal

    def _measure(self, wanted: Array) -> None:
        stage, episode, here = self._stage, self._episode, self._episode.guarded.goal
        beacon_m = np.array(stage.beacon.position)
        target_m = beacon_target_m(stage.arm, beacon_m, wanted)
        pose = episode.permitted(pose_near(stage.arm, here, target_m, beacon_m, stage.beacon.approach_m, episode.context.rng))
        readings = list[GasReading]()
        for sensed in sniff(episode.context, self._sensor, pose, stage.sniff_s):
            self._survey.trace.add(sensed)
            readings += [sensed] if isinstance(sensed, GasReading) else []
        self._survey.measured(pose, readings)

    def _spent_s(self) -> float:
        return seconds(self._episode.guarded.t_ns - self._began_ns)

    def _observation(self) -> dict[str, Floats]:
        return as_floats(self._survey.observe(self._episode.guarded.goal, self._spent_s()))

    def _info(self) -> dict[str, Any]:
        return {"moves": len(self._survey.poses), "seconds": self._spent_s(), "known_nats": self._survey.known_nats}
