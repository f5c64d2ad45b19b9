"""Random streams: truth, disturbance and measurement are independent, so the same truth can be measured with other noise or turbulence."""

import zlib

import numpy as np

from oio.core.settings import in_range, settings


@settings
class Seeds:
    """Seeds of the three streams; by default all are `seed`, and the streams are independent of each other all the same."""

    truth: int  # places, strengths, wind, spread of specimens, encoder drift
    disturbance: int  # turbulence
    measurement: int  # sensor noise

    def check(self) -> None:
        """Refuse negative seeds."""
        in_range(self, truth=(0, 2**63), disturbance=(0, 2**63), measurement=(0, 2**63))

    def rng(self, stream: str, purpose: str) -> np.random.Generator:
        """The generator of one purpose in one stream; a new purpose does not shift the numbers of another."""
        return np.random.default_rng([getattr(self, stream), zlib.crc32(stream.encode()), zlib.crc32(purpose.encode())])
