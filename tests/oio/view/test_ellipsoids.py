"""Bodies of a belief: what is drawn of it, and that it is a rotation and a size."""

import numpy as np

from oio.core.quaternions import rotation
from oio.log import BeliefScene
from oio.log.scene import CHI2_95
from oio.view.ellipsoids import hypotheses, range_spheres

PLACE = np.array([0.3, -0.1, 0.2])


def scene(*bodies, radii=()):
    return BeliefScene(0, np.tile(PLACE, (len(radii), 1)), np.array(radii), list(bodies), "")


def test_half_axes_and_turns_are_those_of_the_covariances():
    rng = np.random.default_rng(2)
    covs = [m @ m.T for m in rng.normal(size=(8, 3, 3))]
    centres, half_m, turns, lengths = hypotheses(
        [scene(*((PLACE, cov) for cov in covs[:3])), scene(), scene(*((PLACE, cov) for cov in covs[3:]))]
    )
    assert lengths == [3, 0, 5] and np.array_equal(centres, np.tile(PLACE, (8, 1)))
    for cov, half, turn in zip(covs, half_m, turns, strict=True):
        np.testing.assert_allclose(rotation(turn) * half**2 @ rotation(turn).T, CHI2_95 * cov, atol=1e-12)
        assert np.isclose(np.linalg.det(rotation(turn)), 1.0)


def test_what_is_not_finite_is_left_out():
    odd = np.full((3, 3), np.nan)
    assert hypotheses([scene((PLACE, odd)), scene((PLACE * np.inf, np.eye(3)), (PLACE, np.eye(3)))])[3] == [0, 1]
    centres, half_m, turns, lengths = range_spheres([scene(radii=[0.1, np.nan]), scene(), scene(radii=[0.3])])
    assert lengths == [1, 0, 1] and half_m.tolist() == [[0.1] * 3, [0.3] * 3] and len(centres) == len(turns) == 2
    assert [len(part) for part in hypotheses([scene()])] == [0, 0, 0, 1]
