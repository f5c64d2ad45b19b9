"""The 3-D scene: what is shown at first, what the legend shows, and that ellipsoids are those of the covariances."""

import numpy as np
import pytest

from oio.figures.style import BEACON, VARIANTS
from oio.report.material import Material
from oio.report.scene_3d import TELLING, traces
from oio.report.scene_shapes import HIDDEN, ellipsoids, regions_95


@pytest.fixture(scope="module")
def drawn(made):
    return traces(Material.read(made[0]))


def test_every_entry_of_the_legend_is_there_once(drawn):
    names = [trace["name"] for trace in drawn if trace.get("showlegend", True)]
    assert len(set(names)) == len(names)
    assert {"arm", "true nose", "nose, calibrated", "its 95 % regions", "beacon (known place)", "true source"} <= set(names)


def test_what_was_before_calibration_is_hidden_and_shown_together(drawn):
    for words, color in VARIANTS.values():
        group = [trace for trace in drawn if trace.get("legendgroup", "").startswith(f"{words}:")]
        assert [trace["type"] for trace in group] == ["scatter3d", "mesh3d", "mesh3d", "scatter3d"]
        assert {trace["visible"] for trace in group} == {HIDDEN}
        assert group[1]["color"] == color and sum(trace.get("showlegend", True) for trace in group) == 1


def test_the_smallest_range_spheres_are_shown_and_the_others_hidden(drawn, made):
    shown, hidden = (next(t for t in drawn if t["type"] == "mesh3d" and t["color"] == BEACON and t["visible"] == v) for v in (True, HIDDEN))
    repeat = Material.read(made[0]).stages["map_beliefs"]["repeats"][-1]
    radii_mm = np.sort(1e3 * np.array(repeat["radii_m"]))
    found = [np.ptp(np.split(np.array(mesh["z"]), n)[i]) / 2.0 for mesh, n in ((shown, TELLING), (hidden, 2)) for i in range(n)]
    np.testing.assert_allclose(found, radii_mm, atol=0.2)


def test_an_ellipsoid_holds_its_region():
    cov = np.array([[4.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 1.0]]) * 1e-4
    mesh = regions_95([(np.array([0.1, 0.2, 0.3]), cov)], "region", "red", 0.5)
    off = np.stack([mesh[axis] for axis in "xyz"], axis=1) / 1e3 - [0.1, 0.2, 0.3]
    np.testing.assert_allclose(np.einsum("ki,ij,kj->k", off, np.linalg.inv(cov), off), 7.815, rtol=0.03)


def test_the_triangles_close_every_surface():
    mesh = ellipsoids([(np.zeros(3), np.eye(3)), (np.ones(3), np.eye(3))], "two", "red", 0.5)
    sides = [tuple(sorted(side)) for i, j, k in zip(mesh["i"], mesh["j"], mesh["k"], strict=True) for side in ((i, j), (j, k), (k, i))]
    assert all(sides.count(side) == 2 for side in set(sides))
    assert max(mesh["i"]) < len(mesh["x"])
