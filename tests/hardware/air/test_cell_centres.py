"""Wind of a CFD mesh from CSV: what several programs write says the same, a linear wind stays linear, and what is not right is refused."""

import os

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


@pytest.mark.parametrize("flat", [1.0, 0.5, 0.1, 0.05])
def test_flat_cells_are_no_holes(flat):
    """A structured mesh whose cells are flat has the wind it was given everywhere; so has one that grows from the floor."""
    axes = [np.arange(0.0, 1.01, 0.1), np.arange(0.0, 1.01, 0.1), np.arange(0.0, 0.61, 0.1 * flat)]
    p = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    _, step, grid = resampled(p, np.column_stack([0.2 + 0.1 * p[:, 2], 0.1 * p[:, 0], 0.0 * p[:, 0]]))
    np.testing.assert_allclose(step, [0.1, 0.1, 0.1 * flat], rtol=0.01)
    np.testing.assert_allclose(grid[..., 0], np.broadcast_to(0.2 + 0.1 * axes[2], grid.shape[:3]), atol=1e-4)
    np.testing.assert_allclose(grid[..., 1], np.broadcast_to(0.1 * axes[0][:, None, None], grid.shape[:3]), atol=1e-4)


def test_layers_that_grow_from_the_floor_keep_their_wind():
    z = np.cumsum(0.002 * 1.2 ** np.arange(20))
    xy = np.arange(0.025, 1.0, 0.05)
    p = np.stack(np.meshgrid(xy, xy, z, indexing="ij"), axis=-1).reshape(-1, 3)
    _, _, grid = resampled(p, np.tile([0.2, 0.0, 0.0], (len(p), 1)))
    np.testing.assert_allclose(grid[..., 0], 0.2, atol=1e-9)


def test_behind_an_obstacle_is_the_wind_of_the_nearest_cells():
    middle, half_m = np.array([0.1, 0.0, 0.3]), 0.2
    p = cells()
    p = p[np.any(np.abs(p - middle) > half_m, axis=1)]
    _, _, grid = resampled(p, np.tile([0.3, 0.0, 0.0], (len(p), 1)))
    np.testing.assert_allclose(grid, np.broadcast_to([0.3, 0.0, 0.0], grid.shape), atol=1e-6)


def test_a_mesh_of_one_layer_is_the_same_at_every_height(tmp_path):
    p = cells()
    p[:, 2] = 0.25
    wind = read_cell_centres(write(tmp_path / "wind.csv", p, linear(p)), 1.0).wind
    assert wind.values.shape[3] == 1
    np.testing.assert_allclose(wind.at(0.0, np.array([[0.1, 0.1, 0.9]])), linear(np.array([[0.1, 0.1, 0.25]])), atol=2e-5)


def moments(folder, names, shuffled=False):
    p, rng = cells(), np.random.default_rng(5)
    folder.mkdir(exist_ok=True)
    for k, name in enumerate(names):
        order = rng.permutation(len(p)) if shuffled else np.arange(len(p))
        write(folder / name, p[order], (linear(p) + k)[order])
    return folder


@pytest.mark.parametrize(
    ("names", "frame_s"),
    [
        (["wind_at_cell_centers_0.csv", "wind_at_cell_centers_1.csv", "wind_at_cell_centers_2.csv"], 0.5),
        (["U_8.csv", "U_9.csv", "U_10.csv"], 0.5),  # not as words
        (["U_0.8.csv", "U_0.9.csv", "U_1.0.csv"], 0.1),
        (["wind_0.CSV", "wind_1.csv", "wind_2.Csv"], 0.5),
        (["t=0.csv", "t=0.5.csv", "t=1.csv"], 0.5),
    ],
)
def test_numbered_files_are_moments_of_one_wind_in_the_order_of_their_numbers(tmp_path, names, frame_s):
    wind = read_air(str(moments(tmp_path / "air", names, shuffled=True)), frame_s).wind
    here = np.array([[0.1, 0.1, 0.3]])
    np.testing.assert_allclose(wind.t_s, frame_s * np.arange(3))
    for k in (0, 0.5, 1, 2):
        np.testing.assert_allclose(wind.at(k * frame_s, here), linear(here) + k, rtol=1e-4)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (["wind_0.csv", "wind_1.csv", "wind_3.csv"], r"not equally spaced \(0, 1, 3\): a moment is missing"),
        (["wind_0.csv", "wind_00.csv"], "there twice"),
        (["wind_0.csv", "last.csv"], "their names must be one word and a number"),
        (["p_0.csv", "wind_1.csv"], "their names must be one word and a number"),
        (["U_0.25.csv", "U_0.5.csv"], r"0\.25 apart by their names, but air\.frame_s is 0\.5\. Type air\.frame_s=0\.25"),
    ],
)
def test_a_folder_that_is_no_series_is_refused(tmp_path, names, said):
    with pytest.raises(BadInput, match=said):
        read_air(str(moments(tmp_path / "air", names)), 0.5)


def test_a_file_that_was_overwritten_in_its_folder_is_read_again(tmp_path):
    p, here = cells(), np.array([[0.1, 0.1, 0.3]])
    path = write(tmp_path / "wind_0.csv", p, linear(p))
    first = read_air(str(tmp_path), 1.0).wind.at(0.0, here)
    write(path, p, linear(p) + 1.0)
    os.utime(path, ns=(path.stat().st_atime_ns, path.stat().st_mtime_ns + 1_000_000_000))
    np.testing.assert_allclose(read_air(str(tmp_path), 1.0).wind.at(0.0, here), first + 1.0, rtol=1e-4)


def test_moments_on_other_meshes_are_refused(tmp_path):
    p = cells()
    write(tmp_path / "wind_0.csv", p, linear(p))
    write(tmp_path / "wind_1.csv", p + 0.01, linear(p))
    with pytest.raises(BadInput, match=r"wind_1\.csv: its cell centres are not those of wind_0\.csv"):
        read_air(str(tmp_path), 1.0)


@pytest.mark.parametrize("name", ["wind.csv", "empty"])
def test_a_folder_without_a_table_is_refused_whatever_its_name(tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(BadInput, match="neither a CSV of wind nor GADEN's"):
        read_air(str(tmp_path / name), 1.0)


def test_a_large_mesh_is_thinned_to_what_memory_holds(monkeypatch):
    monkeypatch.setattr("hardware.air.cell_centres.MOST_NODES", 500)
    p = cells()
    low, step, grid = resampled(p, linear(p))
    assert np.prod(grid.shape[:3]) <= 500
    np.testing.assert_allclose(low + step * (np.array(grid.shape[:3]) - 1), np.max(p, axis=0))


GOOD = "".join(f"{x / 10},{y / 10},{z / 10},0.1,0.2,0.3\n" for x in range(3) for y in range(3) for z in range(3))


@pytest.mark.parametrize(
    ("header", "changed"),
    [
        ("# x,y,z,u,v,w", None),
        ("% x,y,z,u,v,w", None),
        ("x,y,z,U,Vx,Vy,Vz", lambda row: [*row[:3], "9.9", *row[3:]]),  # a magnitude beside its components
        ("x,y,z,V,Vx,Vy,Vz", lambda row: [*row[:3], "9.9", *row[3:]]),
        (",x,y,z,u,v,w", lambda row: ["7", *row]),  # an index without a name
        ('x,y,z,u,v,w,"Temperature (°C)"', lambda row: [*row, "20"]),
        ("name,x,y,z,u,v,w", lambda row: ['"room, north"', *row]),
        ("x,y,z,u,v,w", lambda row: [f'"{cell}"' for cell in row]),
        ("x,y,z,u,v,w", lambda row: [*row, "", ""]),  # delimiters at the end
        ("X_m,x,y,z,u,v,w", lambda row: ["5", *row]),
    ],
)  # fmt: skip
@pytest.mark.parametrize(("encoding", "end"), [("utf-8", "\n"), ("utf-16", "\r\n"), ("latin-1", "\r")])
def test_what_surrounds_the_columns_does_not_matter(tmp_path, header, changed, encoding, end):
    rows = [row.split(",") for row in GOOD.splitlines()]
    lines = [header, *(",".join(row if changed is None else changed(row)) for row in rows), ""]
    (tmp_path / "wind.csv").write_bytes(end.join(lines).encode(encoding))
    wind = read_cell_centres(tmp_path / "wind.csv", 1.0).wind
    np.testing.assert_allclose(wind.step_m, 0.1)
    np.testing.assert_allclose(wind.values[0], np.broadcast_to([0.1, 0.2, 0.3], (3, 3, 3, 3)), atol=1e-6)


def test_blanks_separate_units_are_kept_and_a_hash_is_no_column(tmp_path):
    rows = GOOD.replace(",", "  ")
    for header in ("# x y z u v w", "X (cm)  Y (cm) Z (cm) u (cm/s) v (cm/s) w (cm/s)", '"X [ cm ]" "Y [ cm ]" "Z [ cm ]" u v w'):
        (tmp_path / "wind.txt").write_text(f"{header}\n{rows}")
        wind = read_air(str(tmp_path / "wind.txt"), 1.0 + len(header)).wind
        np.testing.assert_allclose(wind.step_m, 0.001 if "cm" in header else 0.1)
        np.testing.assert_allclose(wind.values[..., 0], 0.001 if "cm/s" in header else 0.1, rtol=1e-5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("2, 0, 0\n1, 0.5, 0.2\n", "no line names the places x, y, z and the wind u, v, w.*the first is '2, 0, 0'"),
        ("", "no line names"),
        ("x,y,z,u,v\n1,2,3,4,5\n", "line 1 lacks w"),
        ("x,y,u,v\n1,2,3,4\n", "line 1 lacks z; line 1 lacks w"),
        ("x,y,z,u,v,w\n0,0,0,1,fast,3\n", "line 2 has 'fast' where its header has a number"),
        ("x;y;z;u;v;w\n0;0;0,5;1;2;3\n", "line 2 has '0,5' where its header has a number; export with decimal points"),
        ("x,y,z,u,v,w\n0,0,0,1\n", "line 2 has 4 cells, but its header names 6"),
        ("x,y,z,u,v,w\n0,0,0,1,2,3\n1,0,0,0,0,0,1,0,2,0,3,0\n", "line 3 has 12 cells, but its header names 6"),
        ("x,y,z,u,v,w\n[Name]\n", "line 2 has 1 cells"),
        ("x,y,z,u,v,w\n0,0,0,1,2,nan\n", "1 of 1 rows have values that are not finite"),
        ("x,y,z,u,v,w\n", "it has 0 rows"),
        ("x,y,z,u,v,w\n" + "0,0,0,1,2,3\n" * 20, "it has 1 rows at different places"),
        ("x,y,z,u,v,w\n" + GOOD + GOOD.replace("0.2,0.3", "-0.2,0.3"), "27 places have two winds; export one moment"),
        ("x,y,z,u,v,w\n" + GOOD + "1,1,1,-9999,-9999,-9999\n", r"its wind is up to 1e\+04 m/s, and more than 100 is none"),
        ("x (km),y (km),z (km),u,v,w\n0,0,0,1,2,3\n", "column 'x \\(km\\)' has the unit 'km', but a length is in m, "),
        ("x,y,z,Points:0,Points:1,Points:2,u,v,w\n", "its columns 'points:0' and 'x' could both be meant"),
        ("x,y,z,U,u,v,w\n", "two of its columns are named 'u', if capitals do not count"),
        ("PK\x03\x04", "a ZIP archive or a spreadsheet"),
    ],
)
def test_what_is_no_wind_of_cell_centres_is_refused(tmp_path, text, said):
    (tmp_path / "wind.csv").write_text(text)
    with pytest.raises(BadInput, match=said):
        read_cell_centres(tmp_path / "wind.csv", 1.0)


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
