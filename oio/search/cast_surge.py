"""Surge-and-cast search: surge upwind while in the plume, cast crosswind, ever wider, when the plume is lost.

Moths do it (Baker 1990), Li, Farrell and others (2006) put it on vehicles; Balkovsky & Shraiman (2002) explain why casts must widen. A
move is a hit when enough of its readings were bouts and its signal is not below that of the last hit; each miss lowers that threshold.
The wind is that of the range law, k = U / 2K. In still air the surge direction is from the last hit but one to the last hit.
In three dimensions the casts rotate in the plane normal to that direction, by the golden angle, so that they never repeat.
"""

from typing import Annotated

import numpy as np

from oio.core.records import Array
from oio.core.settings import Within, refuse_below, settings
from oio.gas.range_law import WIND
from oio.search.sniff_history import believed_law, goals, joint_offsets
from oio.search.step_planning import box_diagonal_m, random_step, step_toward, tangent_directions
from oio.search.view import Move, View

GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # golden angle [rad]
ALONG = 0.9  # a direction whose crosswind component (sine of its angle to the wind) is less counts as along the wind


@settings
class CastSurge:
    """Surge-and-cast strategy; lengths are fractions of the diagonal of the nose's workspace box."""

    surge: Annotated[float, Within(1e-3, 1)]  # length of one step upwind
    cast_growth: Annotated[float, Within(1e-3, 1)]  # the n-th cast is n times this wide, to either side
    max_cast: Annotated[float, Within(1e-3, 10)]  # beyond this width the plume is lost: poses are random
    hit: Annotated[float, Within(0, 1)]  # least fraction of a move's readings that are bouts
    threshold_decay: Annotated[float, Within(0, 1)]  # factor on the signal threshold of a hit after every miss
    windy_per_m: Annotated[float, Within(0, 1e3)]  # |k| below this counts as still air

    def check(self) -> None:
        """Raise BadInput for a widest cast below the first."""
        refuse_below(self, "max_cast", "cast_growth")

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """Return the next joint goal (n,) rad."""
        hits = self.hits(view.moves)
        last = hits[-1] + 1 if hits else 0  # the first goal is home
        casts = len(view.moves) - last + (0 if hits else 1)  # no hit yet: begin with a cast
        if casts * self.cast_growth > self.max_cast:
            return random_step(view, rng)
        q, diag_m = goals(view), box_diagonal_m(view)
        origin_m, direction = view.arm.nose(q[last] - joint_offsets(view)), self.upwind(view, hits)
        if casts == 0:
            return step_toward(view, origin_m + self.surge * diag_m * direction, rng)
        return step_toward(
            view, origin_m + casts * self.cast_growth * diag_m * cast_direction(direction, tangent_directions(view, q[last]), casts), rng
        )

    def hits(self, moves: tuple[Move, ...]) -> list[int]:
        """Return the indices of the moves that were hits."""
        found, threshold_ppm = list[int](), 0.0
        for i, move in enumerate(moves):
            hit = move.bouts > 0.0 and move.bouts >= self.hit and move.ppm >= threshold_ppm
            threshold_ppm = move.ppm if hit else threshold_ppm * self.threshold_decay
            found += [i] if hit else []
        return found

    def upwind(self, view: View, hits: list[int]) -> Array:
        """Return the surge direction (3,), a unit vector: upwind, or in still air from hit to hit; before any, away from the shoulder."""
        k = believed_law(view)[WIND]
        p = view.arm.nose(goals(view) - joint_offsets(view))
        previous, last = p[hits[-2] + 1 if len(hits) > 1 else 0], p[hits[-1] + 1 if hits else 0]
        candidates = (-k if np.linalg.norm(k) >= self.windy_per_m else np.zeros(3), last - previous, p[0] - view.arm.shoulder)
        direction = next((v for v in candidates if np.linalg.norm(v) > 1e-6), np.array([1.0, 0.0, 0.0]))
        return np.asarray(direction / np.linalg.norm(direction))


def cast_direction(direction: Array, can: Array, n: int) -> Array:
    """Return the crosswind unit vector (3,) of the n-th cast, among the directions (3, r) that the nose can move in.

    The casts rotate where two directions are left, alternate left and right where one is, and back and forth where none is.
    """
    axes, sine, _ = np.linalg.svd(can - np.outer(direction, direction @ can), full_matrices=False)
    crosswind = axes[:, sine > ALONG]
    crosswind = crosswind if crosswind.shape[1] else can
    if crosswind.shape[1] == 1:
        return np.asarray(crosswind[:, 0] * (-1.0) ** n)
    return np.asarray(crosswind[:, 0] * np.cos(n * GOLDEN) + crosswind[:, 1] * np.sin(n * GOLDEN))
