"""How slow this computer is: limits of time are those of a usual one."""

import time


def slowness() -> float:
    """How long this computer counts to a million, over 55 ms, which a usual one takes; the best of five times."""

    def counted_s() -> float:
        began_s, total = time.perf_counter(), 0
        for number in range(1_000_000):
            total += number
        return time.perf_counter() - began_s

    return min(counted_s() for _ in range(5)) / 0.055
