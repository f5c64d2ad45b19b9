"""Range of the signals, readings above clean air, that a calibration or a search met."""

import numpy as np

from oio.core.records import Array
from oio.gas.bouts import ElementBaseline
from oio.gas.trace import Sniffs, Trace

GAS_SIGMAS = 8.0  # above clean air a reading is gas, in its own standard deviations
SHARE = 0.95


def highest_signals(sniffs: Sniffs, baselines: tuple[ElementBaseline, ...]) -> tuple[float, ...]:
    """Return the highest signal of each element [ppm], 0 or more."""
    signals = _signals(sniffs, baselines)
    return tuple(_highest(signals[sniffs.element == e]) for e in range(len(baselines)))


def gas_signals(trace: Trace, baselines: tuple[ElementBaseline, ...]) -> tuple[float, ...]:
    """Return the signal [ppm] of each element below which 95 % of its readings in gas are: single puffs do not count. 0 without gas."""
    if len(trace) < 2:
        return (0.0,) * len(baselines)
    sniffs = trace.as_arrays()
    signals = _signals(sniffs, baselines)
    gas = signals > GAS_SIGMAS * sniffs.sigma_ppm
    parts = (signals[gas & (sniffs.element == e)] for e in range(len(baselines)))
    return tuple(float(np.quantile(part, SHARE)) if len(part) else 0.0 for part in parts)


def _signals(sniffs: Sniffs, baselines: tuple[ElementBaseline, ...]) -> Array:
    return np.asarray(sniffs.ppm - np.array([b.ppm for b in baselines])[sniffs.element])


def _highest(signals: Array) -> float:
    return float(np.max(signals, initial=0.0, where=np.isfinite(signals)))
