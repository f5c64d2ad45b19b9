"""Quaternions of the log's poses: those of scipy, and a rotation there and back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from oio.core.quaternions import quaternion, rotation

HALF_TURNS = [Rotation.from_rotvec(np.pi * axis) for axis in np.eye(3)]
TURNS = [Rotation.identity(), *HALF_TURNS, *Rotation.random(200, random_state=3)]


@pytest.mark.parametrize("turn", TURNS, ids=lambda turn: str(np.round(turn.as_rotvec(), 2)))
def test_there_and_back_and_as_scipy_says(turn):
    matrix = turn.as_matrix()
    q = quaternion(matrix)
    assert np.linalg.norm(q) == pytest.approx(1.0)
    assert min(np.abs(q - turn.as_quat()).max(), np.abs(q + turn.as_quat()).max()) < 1e-12  # q and -q are one rotation
    np.testing.assert_allclose(rotation(3.0 * q), matrix, atol=1e-12)
