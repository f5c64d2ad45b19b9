# %% [markdown]
# # Readings and poses in, source and covariance out
# The arrays here are made up, so that everybody can run this: a carbon dioxide sensor is led by hand through a cube of half a metre,
# and a source stands at (0.12, -0.08, 0.05) m. Put yours in their place: times in seconds, places in metres, readings in ppm.

# %%
import numpy as np

rng, t_s, source_m = np.random.default_rng(0), np.arange(0.0, 60.0, 0.1), np.array([0.12, -0.08, 0.05])
nose_m = 0.25 * np.sin(np.outer(t_s, [0.5, 0.37, 0.23]) + np.array([0.0, 1.0, 2.0]))
gas_ppm = 30.0 / np.linalg.norm(nose_m - source_m, axis=1)  # a steady plume in still air
sensed_ppm = np.zeros_like(gas_ppm)
for i in range(1, len(t_s)):  # the sensor follows with a lag of 0.3 s
    sensed_ppm[i] = sensed_ppm[i - 1] + (gas_ppm[i - 1 : i + 1].mean() - sensed_ppm[i - 1]) * (1.0 - np.exp(-0.1 / 0.3))
ppm = 420.0 + sensed_ppm + 3.0 * rng.standard_normal(len(t_s))

# %%
import oio

readings = oio.Readings(t_s, ppm=ppm)
path = oio.NosePath(t_s, nose_m)  # or oio.JointPath(t_s, q) of an arm
found = oio.locate(readings, path, setup=oio.Setup(sensor="ndir"))
print("source [mm]:", np.round(1e3 * found.mean_m).astype(int))
print("standard deviations [mm]:", np.round(1e3 * np.sqrt(np.diag(found.cov_m2))).astype(int))
print("verdict:", found.verdict)
for reason in found.reasons:
    print(" -", reason)
