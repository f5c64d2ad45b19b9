"""Multi-armed bandit search of the paper: an action moves one joint one step left or right, or none; a bout is the reward.

With one DoF these are its three arms (left, right, stay); every further joint adds two. Values are discounted means and the choice is
discounted UCB1 (Garivier & Moulines 2011), because the best direction changes as the nose moves.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.kinematics.arm import Arm
from oio.search.view import View


@dataclass(frozen=True, slots=True, eq=False)
class Values:
    """Action values: discounted reward and count of each arm of the bandit (2 joints + 1,)."""

    reward: Array
    count: Array

    @staticmethod
    def none(joints: int) -> "Values":
        """Return the values before the first move: all zero."""
        return Values(np.zeros(2 * joints + 1), np.zeros(2 * joints + 1))


@settings
class Bandit:
    """Discounted UCB1 over single-joint steps."""

    step_rad: Annotated[float, Within(1e-3, 2)]  # of one joint
    discount: Annotated[float, Within(0.1, 1)]  # per move; 1: no forgetting
    exploration_bonus: Annotated[float, Within(0, 100)]  # weight of the exploration bonus

    def choose(self, values: Values, allowed: np.ndarray, rng: np.random.Generator) -> int:
        """Return the arm with the greatest upper confidence bound among the allowed ones; untried ones first, ties at random."""
        count = np.maximum(values.count, 1e-9)
        bonus = self.exploration_bonus * np.sqrt(np.log(max(float(np.sum(values.count)), 1.0)) / count)
        bound = np.where(values.count < 0.05, np.inf, values.reward / count + bonus)
        bound[~allowed] = -np.inf
        return int(rng.choice(np.flatnonzero(bound == np.max(bound))))

    def rewarded(self, values: Values, chosen: int, reward: float) -> Values:
        """Return the values after a move with this reward."""
        total, count = self.discount * values.reward, self.discount * values.count
        total[chosen] += reward
        count[chosen] += 1.0
        return Values(total, count)

    def goal(self, q: Array, chosen: int) -> Array:
        """Return the joint goal (n,) rad of an arm of the bandit: 0 stays, 1 + 2 j and 2 + 2 j move joint j down and up."""
        new = np.array(q)
        if chosen > 0:
            new[(chosen - 1) // 2] += self.step_rad if chosen % 2 == 0 else -self.step_rad
        return new

    def allowed(self, arm: Arm, q: Array, joints: int) -> np.ndarray:
        """Return which arms of a bandit over the first `joints` joints keep the nose in its workspace box (2 joints + 1,)."""
        return np.array([arm.is_allowed(self.goal(q, i)) for i in range(2 * joints + 1)])

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """Return the next joint goal (n,) rad, with the action values recomputed from all moves so far."""
        q, values = view.arm.home, Values.none(view.arm.dof)
        for move in view.moves:
            values = self.rewarded(values, self._action_taken(q, move.q), move.bouts)
            q = move.q
        return self.goal(q, self.choose(values, self.allowed(view.arm, q, view.arm.dof), rng))

    def _action_taken(self, before: Array, after: Array) -> int:
        moved = np.flatnonzero(np.abs(after - before) > 0.5 * self.step_rad)
        if len(moved) == 0:
            return 0
        return int(1 + 2 * moved[0] + (after[moved[0]] > before[moved[0]]))
