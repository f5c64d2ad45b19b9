"""Surge and cast: go upwind while the plume is smelt, cast across the wind, ever wider, when it is lost.

What moths do (Baker 1990), put on vehicles by Li, Farrell and others (2006); Balkovsky & Shraiman (2002) say why casts must widen. A move
is a hit when enough of its readings were bouts and its signal is not below that of the last hit; each miss lowers what is asked for.
The wind is that of the range law, k = U / 2K. In still air the nose goes on in the direction in which the last hit lay from the one
before. In space casts go round in the plane across, by the golden angle, so that they never repeat.
"""

import numpy as np

from oio.core.records import Array
from oio.core.settings import in_range, settings
from oio.gas.range_law import WIND
from oio.search.sniff_history import believed_law, goals, joint_offsets
from oio.search.step_planning import box_diagonal_m, random_step, step_toward, tangent_directions
from oio.search.view import Move, View

GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # rad
ALONG = 0.9  # a direction of the nose with less than this across the wind (sine) is along it


@settings
class CastSurge:
    """Lengths are fractions of the diagonal of the nose's box."""

    surge: float  # one step upwind
    widen: float  # the n-th cast is n times this wide, to either side
    widest: float  # beyond, the plume is lost and looked for anywhere
    hit: float  # fraction of a move's readings that must be bouts
    fade: float  # of the last hit's signal is asked for after every miss
    windy_per_m: float  # |k| below this is still air

    def check(self) -> None:
        """Refuse senseless steps and fractions."""
        in_range(self, surge=(1e-3, 1.0), widen=(1e-3, 1.0), widest=(self.widen, 10.0), hit=(0.0, 1.0), fade=(0.0, 1.0))
        in_range(self, windy_per_m=(0.0, 1e3))

    def propose(self, view: View, rng: np.random.Generator) -> Array:
        """The next joint goal (n,) rad."""
        hits = self.hits(view.moves)
        last = hits[-1] + 1 if hits else 0  # goals begin with home
        casts = len(view.moves) - last + (0 if hits else 1)  # nothing was smelt yet: begin with a cast
        if casts * self.widen > self.widest:
            return random_step(view, rng)
        q, size = goals(view), box_diagonal_m(view)
        place, direction = view.arm.nose(q[last] - joint_offsets(view)), self.upwind(view, hits)
        if casts == 0:
            return step_toward(view, place + self.surge * size * direction, rng)
        return step_toward(view, place + casts * self.widen * size * across(direction, tangent_directions(view, q[last]), casts), rng)

    def hits(self, moves: tuple[Move, ...]) -> list[int]:
        """Which moves were hits."""
        found, level = list[int](), 0.0
        for i, move in enumerate(moves):
            hit = move.bouts > 0.0 and move.bouts >= self.hit and move.ppm >= level
            level = move.ppm if hit else level * self.fade
            found += [i] if hit else []
        return found

    def upwind(self, view: View, hits: list[int]) -> Array:
        """Unit vector (3,) against the wind, or in still air from hit to hit; before any, away from the shoulder."""
        k = believed_law(view)[WIND]
        p = view.arm.nose(goals(view) - joint_offsets(view))
        before, last = p[hits[-2] + 1 if len(hits) > 1 else 0], p[hits[-1] + 1 if hits else 0]
        ahead = (-k if np.linalg.norm(k) >= self.windy_per_m else np.zeros(3), last - before, p[0] - view.arm.shoulder)
        wanted = next((v for v in ahead if np.linalg.norm(v) > 1e-6), np.array([1.0, 0.0, 0.0]))
        return np.asarray(wanted / np.linalg.norm(wanted))


def across(direction: Array, can: Array, n: int) -> Array:
    """Unit vector (3,) of the n-th cast across a direction (3,), among those (3, r) that the nose can go in.

    Round and round where two are left, left and right where one is; where none is, to and fro.
    """
    left, share, _ = np.linalg.svd(can - np.outer(direction, direction @ can), full_matrices=False)
    sides = left[:, share > ALONG]
    sides = sides if sides.shape[1] else can
    if sides.shape[1] == 1:
        return np.asarray(sides[:, 0] * (-1.0) ** n)
    return np.asarray(sides[:, 0] * np.cos(n * GOLDEN) + sides[:, 1] * np.sin(n * GOLDEN))
