"""The paper's spheres and vertex as a belief map: exact where its assumptions hold, and honest where the spheres determine nothing."""

from dataclasses import replace

import numpy as np
import pytest

from oio.core.errors import BadInput
from oio.gas.trace import Sniffs
from oio.inference.base import Localizer
from oio.inference.sphere_map import SphereMap

LEVEL_PPM = 30.0  # at the reference distance of 0.1 m


@pytest.fixture
def spheres(built):
    return built("belief_map", "belief_map=spheres")


def sniffed(made, source, poses=8, noise=0.0):
    """Readings without lag, drift or fluctuation of a source in still air, six at every rest."""
    rng = np.random.default_rng(5)
    q = np.repeat(made.arm.random_poses(rng, poses), 6, axis=0)
    r = np.linalg.norm(made.arm.nose(q) - source, axis=1)
    t = 0.5 * np.arange(len(q), dtype=float)
    ppm = LEVEL_PPM * (0.1 / np.sqrt(r**2)) + made.mean[made.layout.baseline][0] + noise * rng.standard_normal(len(q))
    where = np.arange(len(q))
    return Sniffs(t, q, where, t, np.zeros(len(q), dtype=int), ppm, np.full(len(q), 0.1), np.zeros(len(q), dtype=bool))


def plain(made, **law):
    """Knowledge of a law without wind or thinning."""
    mean = np.array(made.known.mean)
    mean[4:9] = [1.0, 0.0, 0.0, 0.0, 0.0]
    return replace(made.known, mean=mean, model=replace(made.model, law=replace(made.model.law, **law)))


SOURCE = np.array([0.30, 0.05, 0.18])


@pytest.mark.parametrize("told", [None, float(np.log(LEVEL_PPM))])
def test_the_vertex_is_the_source_where_the_paper_is_right(lab, spheres, told):
    made = lab(5, 1, seed=3)
    (fit,) = spheres.locate(sniffed(made, SOURCE), plain(made, ln_strength=told))
    np.testing.assert_allclose(fit.source, SOURCE, atol=1e-6)
    assert fit.mean[3] == pytest.approx(np.log(LEVEL_PPM), abs=1e-3)
    assert np.trace(fit.source_cov) < 1e-6


def test_the_covariance_is_that_of_the_ranges(lab, spheres):
    made = lab(5, 1, seed=3)
    quiet, noisy = (spheres.locate(sniffed(made, SOURCE, noise=noise), plain(made))[0] for noise in (0.5, 2.0))
    assert 0 < quiet.source_cov[0, 0] < noisy.source_cov[0, 0]
    assert quiet.source_cov[0, 0] == quiet.source_cov[1, 1] and quiet.source_cov[0, 1] == 0.0


def test_too_few_spheres_leave_the_whole_box(lab, spheres):
    made = lab(5, 1, seed=3)
    known = plain(made)
    (fit,) = spheres.locate(sniffed(made, SOURCE, poses=3), known)
    np.testing.assert_array_equal(fit.mean, known.mean)
    np.testing.assert_array_equal(fit.cov, known.cov)


def test_gas_below_the_detection_limit_gives_no_sphere(lab, spheres):
    made = lab(5, 1, seed=3)
    sniffs, known = sniffed(made, SOURCE), plain(made)
    clean = replace(sniffs, ppm=np.full_like(sniffs.ppm, made.mean[made.layout.baseline][0]))
    np.testing.assert_array_equal(spheres.locate(clean, known)[0].mean, known.mean)


def test_both_maps_are_localizers(built, spheres):
    assert isinstance(spheres, Localizer) and isinstance(built("belief_map"), Localizer)
    assert spheres.as_calibrated is spheres


def test_senseless_settings_are_refused():
    with pytest.raises(BadInput, match=r"SphereMap\.limit is 1"):
        SphereMap(path_period_s=0.06, limit=1, detection_sigmas=3.0)
