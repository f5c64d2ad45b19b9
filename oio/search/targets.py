"""Targets of the nose from three numbers between -1 and 1: the action of a policy that is learned."""

import numpy as np

from oio.core.records import Array
from oio.gas.range_law import SOURCE
from oio.search.sniff_history import believed_law
from oio.search.step_planning import box_diagonal_m, step_toward
from oio.search.view import View

REACH = 0.15  # of the diagonal of the workspace box: 18 cm for the SO-101


def box_target_m(view: View, action: Array) -> Array:
    """The place (3,) m in the workspace box at an action (3,): -1 is its lower end on an axis, 1 its upper."""
    low, high = np.array(view.arm.box_low_m), np.array(view.arm.box_high_m)
    return np.asarray(low + 0.5 * (action + 1.0) * (high - low))


def source_target_m(view: View, action: Array) -> Array:
    """The place (3,) m at an action (3,) from the believed source, in units of REACH; the view has a belief."""
    assert view.belief is not None
    return np.asarray(believed_law(view)[SOURCE] + REACH * box_diagonal_m(view) * action)


def source_goal(view: View, action: Array, rng: np.random.Generator) -> Array:
    """The allowed pose (n,) rad whose nose comes nearest to `source_target_m`, off the believed source."""
    return step_toward(view, source_target_m(view, action), rng)


def box_goal(view: View, action: Array, rng: np.random.Generator) -> Array:
    """The allowed pose (n,) rad whose nose comes nearest to `box_target_m`, off the believed source."""
    return step_toward(view, box_target_m(view, action), rng)
