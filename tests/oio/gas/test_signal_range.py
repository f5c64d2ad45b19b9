"""How strong the gas was, above each element's own clean air."""

import numpy as np

from oio.gas.bouts import ElementBaseline
from oio.gas.signal_range import gas_signals, highest_signals
from oio.gas.trace import Sniffs

TWO = tuple(ElementBaseline(ppm, 0.1, ppm, 5, 5.0) for ppm in (1.0, 2.0))


class Traced:
    """A trace of which only its readings count."""

    def __init__(self, *ppm):
        self._ppm = ppm

    def __len__(self):
        return len(self._ppm)

    def as_arrays(self):
        return sensed(self._ppm)


def sensed(ppm, element=None, sigma_ppm=0.1):
    n = len(ppm)
    t_s, element = np.arange(n) + 0.5, np.zeros(n, dtype=int) if element is None else np.array(element)
    ppm, sigma = np.array(ppm, dtype=float), np.full(n, sigma_ppm)
    return Sniffs(t_s, np.zeros((n, 1)), np.arange(n), t_s, element, ppm, sigma, np.zeros(n, dtype=bool))


def test_the_highest_signal_is_above_each_elements_own_clean_air():
    assert highest_signals(sensed([3.0, 9.0, 5.0, 2.5], [0, 1, 0, 1]), TWO) == (4.0, 7.0)
    assert highest_signals(sensed([0.5, np.nan]), TWO) == (0.0, 0.0)


def test_gas_is_what_stands_out_of_the_noise_and_a_single_puff_does_not_count():
    mostly = np.concatenate([np.full(60, 1.2), np.full(39, 5.0), [500.0]])  # noise below 0.8 ppm, gas, and a puff
    assert gas_signals(Traced(*mostly), TWO) == (4.0, 0.0)
    assert gas_signals(Traced(1.7, 1.2, np.nan), TWO) == (0.0, 0.0)
    assert gas_signals(Traced(9.0), TWO) == (0.0, 0.0)  # no trace yet
