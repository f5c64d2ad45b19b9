# %% [markdown]
# # Calibrate once, then localise in another program's loop at 100 Hz
# The sensor and its air are made up, as in `ten_lines.py`; this one stands 12 ppm too high, and is a sixth slower
# than its data sheet.

# %%
import time

import numpy as np

import oio

rng = np.random.default_rng(1)


def sensed(t_s, nose_m, source_m):
    """Readings (m,) [ppm] of a carbon dioxide sensor with a lag of 0.35 s at nose_m (m, 3); no gas where source_m is None."""
    gas_ppm = np.zeros(len(t_s)) if source_m is None else 10.0 / np.linalg.norm(nose_m - source_m, axis=1)
    sensed_ppm = np.zeros_like(gas_ppm)
    for i in range(1, len(t_s)):
        sensed_ppm[i] = sensed_ppm[i - 1] + (gas_ppm[i - 1 : i + 1].mean() - sensed_ppm[i - 1]) * (1.0 - np.exp(-0.1 / 0.35))
    return 432.0 + sensed_ppm + 3.0 * rng.standard_normal(len(t_s))


def path_m(t_s):
    """Places of the nose (m, 3) m."""
    return 0.25 * np.sin(np.outer(t_s, [0.5, 0.37, 0.23]) + np.array([0.0, 1.0, 2.0]))


# %% Twenty seconds of clean air, then two minutes with a source at a known place
t_s, beacon_m = np.arange(0.0, 140.0, 0.1), np.array([0.10, 0.05, 0.0])
clean = t_s < 20.0
ppm = np.concatenate([sensed(t_s[clean], path_m(t_s[clean]), None), sensed(t_s[~clean], path_m(t_s[~clean]), beacon_m)])
calibration = oio.calibrate(
    oio.Readings(t_s, ppm=ppm), oio.NosePath(t_s, path_m(t_s)), beacon_m, clean_air_s=(0.0, 19.9), beacon_s=(19.9, 139.9),
    setup=oio.Setup(sensor="ndir"),
)  # fmt: skip
print(f"offset {calibration.offset_ppm[0]:.0f} ppm, lag {calibration.lag_s[0]:.1f} s, verdict {calibration.verdict}")

# %% The loop of another program: poses at 100 Hz, readings at 10 Hz, a map when there is time for it
odometry = oio.Odometry(calibration, box_m=[[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5]])
t_s = np.arange(0.0, 60.0, 0.01)
places, readings = path_m(t_s), sensed(t_s[::10], path_m(t_s[::10]), np.array([-0.05, 0.08, 0.10]))
busy_s = 0.0
for i in range(len(t_s)):
    began = time.perf_counter()
    odometry.joints(t_s[i], places[i])  # the joints of a nose without an arm are its coordinates
    if i % 10 == 0:
        odometry.reading(t_s[i], ppm=readings[i // 10])
    busy_s += time.perf_counter() - began
    if i in (2000, 4000):
        odometry.locate()
print("faster than real time:", busy_s < t_s[-1])
mean_m, cov_m2 = odometry.source()
print("source [mm]:", np.round(1e3 * mean_m).astype(int))
print("standard deviations [mm]:", np.round(1e3 * np.sqrt(np.diag(cov_m2))).astype(int))
