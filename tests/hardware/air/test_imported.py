"""Air of other programs: every format says the same, units are converted, sources moved, and what is not right is refused by name."""

import math
import struct
import sys
import zlib

import netCDF4
import numpy as np
import pytest
from scipy.io import netcdf_file

from hardware.air.air_recording import Puffs
from hardware.air.filament import Filament
from hardware.air.imported import ImportedGas, ImportedWind, read_air
from oio.bench.trial import run_trial
from oio.core.errors import BadInput

X, Y, Z = np.linspace(-0.2, 0.6, 9), np.linspace(-0.4, 0.4, 5), np.linspace(0.0, 0.5, 6)
T = np.array([0.0, 2.0, 4.0])
SOURCE, RATE = np.array([0.2, 0.0, 0.2]), 0.5
STILL = Filament(
    name="puffs", wind_m_s=0.0, turbulence_m_s=0.0, eddy_s=0.4, meander_m_s=0.0, meander_s=5.0, puffs_per_s=10.0, puff_m=0.01,
    growth_m2_s=0.0, age_s=60.0, range_m=3.0, spin_up_s=0.0,
)  # fmt: skip


def linear_ppm():
    """A field that linear interpolation gives exactly: 10 + x + 2 y + 3 z + t."""
    t, x, y, z = np.meshgrid(T, X, Y, Z, indexing="ij")
    return 10.0 + x + 2.0 * y + 3.0 * z + t


def wind():
    """u = 1 + x, v = y, w = t, likewise."""
    t, x, y, _ = np.meshgrid(T, X, Y, Z, indexing="ij")
    return np.stack([1.0 + x, y, t], axis=-1)


def classic(path):
    return netcdf_file(path, "w")


def arrays(**change):
    made = {"t_s": T, "x_m": X, "y_m": Y, "z_m": Z, "ppm": linear_ppm(), "wind_m_s": wind(), "source_m": SOURCE, "rate_ml_s": RATE}
    made |= change
    return {key: value for key, value in made.items() if value is not None}


def npz(folder, **change):
    np.savez(folder / "air.npz", **arrays(**change))
    return str(folder / "air.npz")


UNITS = ("x", "m"), ("u", "m/s"), ("c", "ppm"), ("t", "s")


def netcdf(folder, units=UNITS, drop=(), rate=RATE, open_=classic, order="txyz", t="t", dims=None, falls=""):
    path, unit = folder / "air.nc", dict(units)
    with open_(str(path)) as file:
        file.source_m, file.rate_ml_s = SOURCE, rate
        named = dict(zip("txyz", dims or (t, "x", "y", "z"), strict=True))
        for name, axis in zip("txyz", (T, X, Y, Z), strict=True):
            file.createDimension(named[name], len(axis))
            variable = file.createVariable(t if name == "t" else name, "d", (named[name],))
            variable[:] = axis[::-1] if name in falls else axis
            variable.units = unit["t"] if name == "t" else unit["x"]
        fields = {"u": wind()[..., 0], "v": wind()[..., 1], "w": wind()[..., 2], "c": linear_ppm()}
        for name, field in fields.items():
            if name not in drop:
                variable = file.createVariable(name, "d", tuple(named[axis] for axis in order))
                turned = np.flip(field, [i for i, axis in enumerate("txyz") if axis in falls])
                variable[:] = turned.transpose(["txyz".index(axis) for axis in order])
                variable.units = unit["c"] if name == "c" else unit["u"]
    return str(path)


def netcdf4(folder, **change):
    return netcdf(folder, open_=lambda path: netCDF4.Dataset(path, "w"), **change)


def gaden(folder, version=2, frames=3, wind_of=(0, 0, 1)):
    """Results of a run with one filament more in every frame; sigma 5 cm, 2e-6 of 4e-5 mol / cm^3: 0.05 ml."""
    cells, cell_m = (len(X) - 1, len(Y) - 1, len(Z) - 1), 0.1
    (folder / "wind").mkdir(parents=True)
    for i in range(frames):
        source = SOURCE.tolist()
        if version == 1:
            header = struct.pack("<i3d3d3i3d3di", 1, -0.2, -0.4, 0.0, 0.6, 0.4, 0.5, *cells, cell_m, cell_m, cell_m, *source, 0)
        else:
            header = struct.pack("<2i3i3f3ff3fi", 2, 4, *cells, -0.2, -0.4, 0.0, 0.6, 0.4, 0.5, cell_m, *source, 0)
        body = b"".join(struct.pack("<i4d", k, 0.2 + 0.01 * k, 0.0, 0.2, 5.0) for k in range(i))
        (folder / f"iteration_{i}").write_bytes(zlib.compress(header + struct.pack("<2di", 2e-6, 4e-5, wind_of[i]) + body))
    for i in set(wind_of[:frames]):
        k, j, x = np.meshgrid(*(np.arange(n) for n in cells[::-1]), indexing="ij")
        np.concatenate([(x + 10.0 * i).ravel(), j.ravel().astype(float), k.ravel().astype(float)]).tofile(
            folder / "wind" / f"wind_iteration_{i}"
        )
    return str(folder)


def gas(path, **change):
    settings = {"name": "gas", "path": path, "frame_s": 0.5, "begins_s": 0.0, "after_end": "hold"} | change
    return ImportedGas(**settings).open(np.random.default_rng(0), np.random.default_rng(1))


def blown(path, **change):
    settings = {"name": "wind", "path": path, "frame_s": 0.5, "begins_s": 0.0, "after_end": "hold", "base_m": (0.0, 0.0, 0.0)}
    made = ImportedWind(**({**settings, "turned_deg": 0.0, "puffs": STILL} | change))
    return made.open(np.random.default_rng(0), np.random.default_rng(1))


@pytest.mark.parametrize("make", [npz, netcdf, netcdf4])
def test_a_grid_is_interpolated_moved_to_the_source_and_scaled(tmp_path, make):
    live = gas(make(tmp_path))
    assert live.ppm(SOURCE) == 0.0
    live.present(SOURCE, RATE)
    assert live.ppm(np.array([0.23, 0.11, 0.07])) == pytest.approx(10.0 + 0.23 + 0.22 + 0.21, rel=1e-6)
    live.step(1.0)
    assert live.ppm(SOURCE) == pytest.approx(10.0 + 0.2 + 0.6 + 1.0, rel=1e-6)
    moved = np.array([0.05, -0.1, 0.1])
    live.present(SOURCE + moved, 3.0 * RATE)
    assert live.ppm(SOURCE + moved) == pytest.approx(3.0 * (10.0 + 0.2 + 0.6), rel=1e-6)
    assert live.ppm(SOURCE + np.array([2.0, 0.0, 0.0])) == 0.0  # outside the grid


def test_after_the_end_it_holds_or_repeats(tmp_path):
    path = npz(tmp_path)
    held, again = gas(path, begins_s=1.0), gas(path, begins_s=1.0, after_end="repeat")
    for live in (held, again):
        live.present(SOURCE, RATE)
        live.step(4.0)
    plain = 10.0 + 0.2 + 0.6
    assert held.ppm(SOURCE) == pytest.approx(plain + 4.0, rel=1e-6)
    assert again.ppm(SOURCE) == pytest.approx(plain + 1.0 + (4.0 % 3.0), rel=1e-6)


@pytest.mark.parametrize("make", [netcdf, netcdf4])
def test_units_are_converted(tmp_path, make):
    first, second = tmp_path / "m", tmp_path / "cm"
    first.mkdir(), second.mkdir()
    plain = read_air(make(first), 1.0)
    other = read_air(make(second, units=(("x", "cm"), ("u", "cm/s"), ("c", "ppb"), ("t", "min"))), 1.0)
    np.testing.assert_allclose(other.gas.step_m, 0.01 * plain.gas.step_m)
    np.testing.assert_allclose(other.gas.values, 1e-3 * plain.gas.values, rtol=1e-6)
    np.testing.assert_allclose(other.wind.values, 1e-2 * plain.wind.values, rtol=1e-6)
    np.testing.assert_allclose(other.wind.t_s, 60.0 * plain.wind.t_s)


@pytest.mark.parametrize("make", [netcdf, netcdf4])
def test_dimensions_may_have_the_order_and_time_the_words_of_the_climate_conventions(tmp_path, make):
    """(time, z, y, x) and `seconds since`, of https://cfconventions.org; on a cube a wrong order would show in no shape."""
    first, second = tmp_path / "own", tmp_path / "cf"
    first.mkdir(), second.mkdir()
    plain = read_air(make(first), 1.0)
    units = (("x", "m"), ("u", "m s-1"), ("c", "ppm"), ("t", "seconds since 2026-01-01 00:00:00"))
    other = read_air(make(second, units=units, order="tzyx", t="time"), 1.0)
    np.testing.assert_array_equal(other.gas.values, plain.gas.values)
    np.testing.assert_array_equal(other.wind.values, plain.wind.values)
    np.testing.assert_array_equal(other.wind.t_s, plain.wind.t_s)


@pytest.mark.parametrize("make", [netcdf, netcdf4])
def test_axes_say_which_dimension_is_theirs_and_may_fall(tmp_path, make):
    """Dimensions of other names, as of WRF, and heights from the ceiling down."""
    first, second = tmp_path / "own", tmp_path / "other"
    first.mkdir(), second.mkdir()
    plain = read_air(make(first), 1.0)
    other = read_air(make(second, order="tzyx", dims=("Time", "west_east", "south_north", "bottom_top"), falls="z"), 1.0)
    np.testing.assert_array_equal(other.gas.values, plain.gas.values)
    np.testing.assert_array_equal(other.wind.values, plain.wind.values)
    np.testing.assert_array_equal(other.wind.low_m, plain.wind.low_m)


@pytest.mark.parametrize("open_", [classic, lambda path: netCDF4.Dataset(path, "w")])
def test_packed_values_are_unpacked_and_missing_ones_refused(tmp_path, open_):
    stored = np.round((linear_ppm() - 10.0) / 0.001).astype(np.int16)
    np.testing.assert_allclose(read_air(packed(tmp_path / "whole.nc", open_, stored), 1.0).gas.values[..., 0], linear_ppm(), atol=6e-4)
    stored[0, 0, 0, 0] = -999
    with pytest.raises(BadInput, match="'c' has values that are not finite"):
        read_air(packed(tmp_path / "gap.nc", open_, stored), 1.0)


def packed(path, open_, stored):
    """A file with c = 10 + 0.001 stored, -999 where it is missing."""
    with open_(str(path)) as file:
        file.source_m, file.rate_ml_s = SOURCE, RATE
        for name, axis in zip("txyz", (T, X, Y, Z), strict=True):
            file.createDimension(name, len(axis))
            variable = file.createVariable(name, "d", (name,))
            variable[:], variable.units = axis, "s" if name == "t" else "m"
        variable = file.createVariable("c", "i2", tuple("txyz"))
        variable.units, variable.scale_factor, variable.add_offset, variable.missing_value = "ppm", 0.001, 10.0, np.int16(-999)
        if open_ is not classic:
            variable.set_auto_maskandscale(False)
        variable[:] = stored
    return str(path)


def test_netcdf_4_without_its_package_says_what_to_install(tmp_path, monkeypatch):
    path = netcdf4(tmp_path)
    monkeypatch.setitem(sys.modules, "netCDF4", None)
    with pytest.raises(BadInput, match=r"pip install 'oio\[netcdf\]', or nccopy -k classic"):
        gas(path)


def test_puffs_are_gaussian_and_a_frame_holds_until_the_next(tmp_path):
    """As pompy writes them, whose radius is the standard deviation."""
    frame, place, sigma, amount = (
        np.array([0, 2, 2]),
        np.array([SOURCE, SOURCE, SOURCE + 0.1]),
        np.array([0.05, 0.05, 0.1]),
        np.full(3, 0.2),
    )
    path = npz(tmp_path, ppm=None, wind_m_s=None, puff_frame=frame, puff_m=place, puff_sigma_m=sigma, puff_ml=amount)
    live = gas(path)
    live.present(SOURCE, RATE)
    one = 0.2 / ((2 * math.pi) ** 1.5 * 0.05**3)
    assert live.ppm(SOURCE) == pytest.approx(one)
    live.step(1.9)
    assert live.ppm(SOURCE) == pytest.approx(one)
    live.step(0.2)
    assert live.ppm(SOURCE) == pytest.approx(0.0)  # no puff in the second frame
    live.step(2.0)
    assert live.ppm(SOURCE) == pytest.approx(one + 0.2 / ((2 * math.pi) ** 1.5 * 0.1**3) * math.exp(-0.5 * 3.0))


@pytest.mark.parametrize("version", [1, 2])
def test_gadens_filaments_are_ppm_by_its_own_formula(tmp_path, version):
    """moles / (sqrt(8 pi^3) sigma_cm^3) / (moles of air in a cm^3) 1e6, as its player has it."""
    made = read_air(gaden(tmp_path / "run", version), 0.5)
    assert isinstance(made.gas, Puffs)
    ppm = 2e-6 / (math.sqrt(8 * math.pi**3) * 5.0**3) / 4e-5 * 1e6
    assert made.gas.ppm(0.5, SOURCE) == pytest.approx(ppm, rel=1e-6)
    assert made.gas.ppm(1.0, SOURCE) == pytest.approx(ppm * (1.0 + math.exp(-0.5 * (1.0 / 5.0) ** 2)), rel=1e-6)
    np.testing.assert_allclose(made.source_m, SOURCE, atol=1e-7)
    assert made.rate_ml_s == pytest.approx(0.05 / 0.5)  # one filament in the first half second
    cell = np.array([[-0.2 + 0.1 * 3.5, -0.4 + 0.1 * 1.5, 0.1 * 2.5]])
    np.testing.assert_allclose(made.wind.at(0.0, cell), [[3.0, 1.0, 2.0]], atol=1e-5)  # x fastest, at the centres of the cells
    np.testing.assert_allclose(made.wind.at(1.0, cell), [[13.0, 1.0, 2.0]], atol=1e-5)


def test_a_wind_carries_puffs_where_they_are(tmp_path):
    """dx / dt = 1 + x from 0: x = e^t - 1; the wind turned with the base by 90 degrees carries them along -y of the arm."""
    field = np.stack([np.broadcast_to(1.0 + X[None, :, None, None], linear_ppm().shape), 0 * linear_ppm(), 0 * linear_ppm()], axis=-1)
    path = npz(tmp_path, ppm=None, wind_m_s=field)
    for turned, way in ((0.0, [1.0, 0.0]), (90.0, [0.0, -1.0])):
        live = blown(path, turned_deg=turned, base_m=(0.0, 0.0, 0.0))
        live.present(np.array([0.0, 0.0, 0.2]), 0.1)
        for _ in range(400):
            live.step(0.001)
        farthest = live.places_m[np.argmax(np.linalg.norm(live.places_m[:, :2], axis=1))]
        released_s = 0.1  # the first of ten puffs a second
        np.testing.assert_allclose(farthest[:2], (math.exp(0.4 - released_s) - 1.0) * np.array(way), atol=0.004)
        assert farthest[2] == pytest.approx(0.2, abs=1e-6)


def test_a_uniform_wind_is_the_filament_models_own(tmp_path):
    """The same speed from a file and from the configuration: mean concentrations down wind agree."""
    turbulent = {"turbulence_m_s": 0.05, "spin_up_s": 20.0, "puffs_per_s": 40.0, "growth_m2_s": 2e-4}
    own = Filament(**({f: getattr(STILL, f) for f in STILL.__dataclass_fields__} | turbulent | {"wind_m_s": 0.1}))
    field = np.zeros((*linear_ppm().shape, 3))
    field[..., 0] = 0.1
    quiet = Filament(**({f: getattr(own, f) for f in own.__dataclass_fields__} | {"wind_m_s": 0.0}))
    live, model = blown(npz(tmp_path, ppm=None, wind_m_s=field), puffs=quiet), own.open(np.random.default_rng(3), np.random.default_rng(4))
    model.set_wind(0.1, -model._wind_rad, 0.0)
    means = []
    for air in (live, model):
        air.present(np.array([0.0, 0.0, 0.2]), 0.5)
        near = []
        for _ in range(1200):
            air.step(0.05)
            near.append([air.ppm(np.array([d, 0.0, 0.2])) for d in (0.1, 0.25)])
        means.append(np.mean(near, axis=0))
    np.testing.assert_allclose(means[0], means[1], rtol=0.25)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"t_s": None}, "it has no 't_s'"),
        ({"x_m": X[::-1]}, "'x_m' does not increase"),
        ({"x_m": X**3}, "the steps of 'x_m' are not equal"),
        ({"ppm": linear_ppm()[:2]}, r"'ppm' has the shape \(2, 9, 5, 6\), but its axes say \(3, 9, 5, 6\)"),
        ({"ppm": linear_ppm() - 100.0}, "negative concentrations"),
        ({"ppm": linear_ppm() * np.nan}, "not finite"),
        ({"ppm": np.array([{}], dtype=object)}, "no NPZ of plain arrays"),
        ({"ppm": None, "wind_m_s": None}, "neither wind nor gas"),
        ({"source_m": None}, "gas needs source_m"),
        ({"rate_ml_s": 0.0}, "gas needs rate_ml_s"),
        ({"ppm": None, "puff_m": np.zeros((2, 3))}, "it has no 'puff_frame'"),
        (
            {"ppm": None, "puff_frame": [0, 7], "puff_m": np.zeros((2, 3)), "puff_sigma_m": [1, 1], "puff_ml": [1, 1]},
            "indices into t_s, 0 to 2",
        ),
    ],
)
def test_what_is_wrong_in_an_npz_is_named(tmp_path, change, said):
    with pytest.raises(BadInput, match=said):
        gas(npz(tmp_path, **change))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda folder: netcdf(folder, (("x", "km"), ("u", "m/s"), ("c", "ppm"), ("t", "s"))),
            "'x' has the unit 'km', but a length is in m, ",
        ),
        (lambda folder: netcdf(folder, (("x", "m"), ("u", "m/s"), ("c", "kg/m3"), ("t", "s"))), "'c' has the unit 'kg/m3'"),
        (lambda folder: netcdf(folder, drop=("v",)), "it has no variable 'v'"),
        (lambda folder: netcdf(folder, rate=-1.0), "gas needs rate_ml_s"),
        (lambda folder: written(folder / "a.nc", b"\x89HDF\r\n\x1a\n" + bytes(100)), "no NetCDF that can be read"),
        (lambda folder: written(folder / "a.nc", b"CDF\x01" + bytes(3)), "no NetCDF that can be read"),
        (lambda folder: written(folder / "a.npz", b"hello"), "no NPZ of plain arrays"),
        (lambda folder: str(folder / "no.npz"), "there is no such file or folder"),
        (lambda folder: str(folder), "run its filament simulator"),
    ],
)
def test_what_is_no_recording_is_refused(tmp_path, make, said):
    with pytest.raises(BadInput, match=said):
        gas(make(tmp_path))


def written(path, data):
    path.write_bytes(data)
    return str(path)


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda folder: (folder / "iteration_1").write_bytes((folder / "iteration_1").read_bytes()[:-9]), "iteration_1 is cut off"),
        (lambda folder: (folder / "iteration_1").write_bytes(b"no zlib"), "is no iteration of GADEN's"),
        (lambda folder: (folder / "iteration_1").write_bytes(zlib.compress(struct.pack("<i", 9) + bytes(200))), "is of version 9"),
        (lambda folder: (folder / "iteration_0").write_bytes(zlib.compress(struct.pack("<i", 2))), "is no iteration"),
        (lambda folder: (folder / "wind" / "wind_iteration_1").unlink(), "wind_iteration_1 is missing"),
        (lambda folder: (folder / "wind" / "wind_iteration_1").write_bytes(bytes(80)), "has 10 values"),
    ],
)
def test_what_is_wrong_in_gadens_folder_is_named(tmp_path, damage, said):
    folder = tmp_path / "run"
    gaden(folder)
    damage(folder)
    with pytest.raises(BadInput, match=said):
        gas(str(folder))


def test_gas_and_wind_are_told_apart(tmp_path):
    first, second = tmp_path / "gas", tmp_path / "wind"
    first.mkdir(), second.mkdir()
    with pytest.raises(BadInput, match=r"has gas, but no wind\. Type air=imported_gas"):
        blown(npz(first, wind_m_s=None))
    with pytest.raises(BadInput, match=r"has wind, but no gas\. Type air=imported_wind"):
        gas(npz(second, ppm=None))


@pytest.mark.parametrize(
    ("change", "said"),
    [({"begins_s": 9.0}, "begins_s is 9, but .* lasts 4 s"), ({"base_m": (9.0, 0.0, 0.0)}, "the wind in .* is known from")],
)
def test_a_base_or_time_that_the_file_lacks_is_refused(tmp_path, change, said):
    with pytest.raises(BadInput, match=said):
        blown(npz(tmp_path), **change)


def test_a_wind_from_a_file_cannot_be_changed(tmp_path):
    with pytest.raises(BadInput, match="comes from its file"):
        blown(npz(tmp_path)).set_wind(0.1, 0.0, 0.0)


def test_an_unknown_way_to_go_on_is_refused():
    with pytest.raises(BadInput, match="'stop', but it can be hold or repeat"):
        ImportedGas(name="gas", path="x", frame_s=0.5, begins_s=0.0, after_end="stop")


@pytest.mark.slow
def test_a_source_in_recorded_gas_is_found(tmp_path):
    """Steady gas about a source, written to a file; calibration and search as in any room."""
    axis = np.linspace(-0.9, 0.9, 73)
    away = np.sqrt(axis[:, None, None] ** 2 + axis[None, :, None] ** 2 + axis[None, None, :] ** 2 + 0.02**2)
    path = npz(tmp_path, x_m=axis, y_m=axis, z_m=axis, t_s=[0.0], ppm=(30.0 / (4 * math.pi * 1.2e-3 * 30.0) * 0.05 / away)[None],
               wind_m_s=None, source_m=np.zeros(3), rate_ml_s=0.05)  # fmt: skip
    words = ("sensor=ndir", "dof=3", "air=imported_gas", f"air.path={path}", "stage.evaluate.paper_assembly=false")
    made = run_trial((*words, "stage.navigate.max_moves=30"), 4)
    assert made["calibrated"]["source_error_m"] < 0.02
