"""Wind of a CFD mesh from CSV: what several programs write says the same, a linear wind stays linear, and what is not right is refused."""

import numpy as np
import pytest

from hardware.air.cell_centres import read_cell_centres, resampled
from hardware.air.imported import ImportedWind, read_air
from oio.bench.trial import composed_trial
from oio.core.errors import BadInput

HEADERS = {  # of u, v, w, x, y, z as each program writes them, the delimiter, and what its unit is of m and m/s
    "ParaView 5.6, GADEN": ('"U:0","U:1","U:2","Points:0","Points:1","Points:2"', ",", 1.0),
    "ParaView 5.10": ("U_0,U_1,U_2,Points_0,Points_1,Points_2", ",", 1.0),
    "STAR-CCM+": ('"Velocity[i] (m/s)","Velocity[j] (m/s)","Velocity[k] (m/s)","X (m)","Y (m)","Z (m)"', ",", 1.0),
    "Fluent": ("x-velocity y-velocity z-velocity x-coordinate y-coordinate z-coordinate", " ", 1.0),
    "CFX": (
        "\n[Name]\nRoom\n\n[Data]\nVelocity u [ m s^-1 ], Velocity v [ m s^-1 ], Velocity w [ m s^-1 ], X [ m ], Y [ m ], Z [ m ]",
        ",",
        1.0,
    ),
    "own, in cm": ("u (cm/s);v (cm/s);w (cm/s);x (cm);y (cm);z (cm)", ";", 100.0),
}
LOW, HIGH = np.array([-0.5, -0.4, 0.0]), np.array([0.7, 0.4, 0.6])


def cells(seed=0):
    """Centres of an irregular mesh, cells of about 5 cm: a lattice, each point moved."""
    axes = [np.arange(low, high + 1e-9, 0.05) for low, high in zip(LOW, HIGH, strict=True)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return lattice + np.random.default_rng(seed).uniform(-0.015, 0.015, lattice.shape)


def linear(p):
    return np.column_stack([0.2 + 0.1 * p[:, 0], 0.05 * p[:, 1] - 0.1 * p[:, 2], 0.03 * p[:, 0]])


def write(path, points, wind, program="ParaView 5.6, GADEN"):
    header, delimiter, units = HEADERS[program]
    rows = "\n".join(delimiter.join(f"{units * v:.6g}" for v in row) for row in np.hstack([wind, points]))
    path.write_text(f"{header}\n{rows}\n")
    return path


@pytest.mark.parametrize("program", HEADERS)
def test_what_each_program_writes_is_the_same_wind(tmp_path, program):
    p = cells()
    wind = read_air(str(write(tmp_path / "wind.csv", p, linear(p), program)), 1.0).wind
    inside = np.random.default_rng(1).uniform(LOW + 0.05, HIGH - 0.05, (50, 3))
    np.testing.assert_allclose(wind.at(0.0, inside), linear(inside), atol=2e-5)


def test_of_columns_that_nobody_asked_for_none_is_read(tmp_path):
    p = cells()
    wind, header = linear(p), "p,U:0,U:1,U:2,Points:0,Points:1,Points:2,vtkValidPointMask"
    rows = "\n".join(",".join([f"{101325}", *(f"{v:.6g}" for v in row), "1"]) for row in np.hstack([wind, p]))
    (tmp_path / "wind.csv").write_text(f"{header}\n{rows}\n", encoding="utf-8-sig")
    here = np.array([[0.1, 0.0, 0.3]])
    np.testing.assert_allclose(read_cell_centres(tmp_path / "wind.csv", 1.0).wind.at(0.0, here), linear(here), atol=2e-5)


def test_a_linear_wind_stays_linear_up_to_the_walls_and_no_node_is_faster_than_its_neighbours():
    p = cells()
    low, step, grid = resampled(p, linear(p))
    nodes = low + step * np.stack(np.meshgrid(*(np.arange(n) for n in grid.shape[:3]), indexing="ij"), axis=-1)
    error = np.abs(grid - linear(nodes.reshape(-1, 3)).reshape(grid.shape))
    assert np.max(error[1:-1, 1:-1, 1:-1]) < 1e-5
    assert np.max(error) < 0.1 * 0.05  # at the walls at most what the wind changes within a cell
    assert np.max(grid[..., 0]) <= np.max(linear(p)[:, 0]) and np.min(grid[..., 0]) >= np.min(linear(p)[:, 0])


def test_there_is_no_wind_inside_an_obstacle():
    """A block of 40 cm in a uniform wind: no mesh, no wind there; a finer mesh at its sides changes nothing."""
    middle, half_m = np.array([0.1, 0.0, 0.3]), 0.2
    p = np.concatenate([cells(), cells(seed=1)[::9]])
    p = p[np.any(np.abs(p - middle) > half_m, axis=1)]
    low, step, grid = resampled(p, np.tile([0.3, 0.0, 0.0], (len(p), 1)))
    nodes = low + step * np.stack(np.meshgrid(*(np.arange(n) for n in grid.shape[:3]), indexing="ij"), axis=-1)
    depth = half_m - np.max(np.abs(nodes - middle), axis=-1)
    assert np.all(grid[depth > 0.15] == 0.0) and np.any(depth > 0.15)  # three cells behind its sides
    np.testing.assert_allclose(grid[depth < 0.0], np.broadcast_to([0.3, 0.0, 0.0], grid[depth < 0.0].shape), atol=1e-6)


def test_a_mesh_of_one_layer_is_the_same_at_every_height(tmp_path):
    p = cells()
    p[:, 2] = 0.25
    wind = read_cell_centres(write(tmp_path / "wind.csv", p, linear(p)), 1.0).wind
    assert wind.values.shape[3] == 1
    np.testing.assert_allclose(wind.at(0.0, np.array([[0.1, 0.1, 0.9]])), linear(np.array([[0.1, 0.1, 0.25]])), atol=2e-5)


def test_numbered_files_are_moments_of_one_wind_in_the_order_of_their_numbers(tmp_path):
    p = cells()
    for k in (0, 2, 10):
        write(tmp_path / f"wind_at_cell_centers_{k}.csv", p, linear(p) + k)
    wind, here = read_air(str(tmp_path), 0.5).wind, np.array([[0.1, 0.1, 0.3]])
    np.testing.assert_array_equal(wind.t_s, [0.0, 0.5, 1.0])
    for t, added in ((0.0, 0.0), (0.25, 1.0), (0.5, 2.0), (1.0, 10.0)):
        np.testing.assert_allclose(wind.at(t, here), linear(here) + added, rtol=1e-4)


def test_a_large_mesh_is_thinned_to_what_memory_holds(monkeypatch):
    monkeypatch.setattr("hardware.air.cell_centres.MOST_NODES", 500)
    p = cells()
    low, step, grid = resampled(p, linear(p))
    assert np.prod(grid.shape[:3]) <= 500
    np.testing.assert_allclose(low + step * (np.array(grid.shape[:3]) - 1), np.max(p, axis=0))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("2, 0, 0\n1, 0.5, 0.2\n", "no line names x, y, z and the wind u, v, w.*the first is '2, 0, 0'"),
        ("", "no line names"),
        ("x,y,z,u,v\n1,2,3,4,5\n", "no line names"),
        ("x,y,z,u,v,w\n0,0,0,1,fast,3\n", "there are not only numbers"),
        ("x,y,z,u,v,w\n0,0,0,1\n", "there are not only numbers"),
        ("x,y,z,u,v,w\n0,0,0,1,2,nan\n", "1 of 1 rows have values that are not finite"),
        ("x,y,z,u,v,w\n", "it has 0 rows"),
        ("x,y,z,u,v,w\n" + "0,0,0,1,2,3\n" * 20, "it has 20 rows at different places"),
        ("x (km),y (km),z (km),u,v,w\n0,0,0,1,2,3\n", "column 'x \\(km\\)' has the unit 'km', but a length is in m, "),
    ],
)
def test_what_is_no_wind_of_cell_centres_is_refused(tmp_path, text, said):
    (tmp_path / "wind.csv").write_text(text)
    with pytest.raises(BadInput, match=said):
        read_cell_centres(tmp_path / "wind.csv", 1.0)


def test_bytes_and_other_meshes_and_names_without_a_number_are_refused(tmp_path):
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00x")
    with pytest.raises(BadInput, match="it is no text"):
        read_cell_centres(tmp_path / "bytes.csv", 1.0)
    folder, p = tmp_path / "moments", cells()
    folder.mkdir()
    write(folder / "wind_0.csv", p, linear(p))
    write(folder / "wind_1.csv", p + 0.01, linear(p))
    with pytest.raises(BadInput, match=r"wind_1\.csv: its cell centres are not those of wind_0\.csv"):
        read_cell_centres(folder, 1.0)
    (folder / "wind_1.csv").rename(folder / "last.csv")
    with pytest.raises(BadInput, match="each name must end with a number of its own"):
        read_cell_centres(folder, 1.0)


def test_puffs_go_with_the_wind_of_a_mesh(tmp_path):
    """Its lowest centres are half a cell above the floor, on which the arm stands."""
    p, still = cells() + np.array([0.0, 0.0, 0.03]), {"turbulence_m_s": 0.0, "growth_m2_s": 0.0, "spin_up_s": 0.0}
    path = write(tmp_path / "wind.csv", p, np.tile([0.2, -0.1, 0.0], (len(p), 1)))
    words = "sensor=ndir", "air=imported_wind", f"air.path={path}", *(f"air.puffs.{key}={value}" for key, value in still.items())
    air = composed_trial(words)[1].backend.air
    assert isinstance(air, ImportedWind)
    live = air.open(np.random.default_rng(0), np.random.default_rng(1))
    live.present(np.array([0.0, 0.0, 0.2]), 0.1)
    for _ in range(100):
        live.step(0.01)
    farthest = live.places_m[np.argmax(live.places_m[:, 0])]
    np.testing.assert_allclose(farthest, [0.2, -0.1, 0.2], atol=0.006)
