"""Random streams: truth, disturbance and measurement are independent, so the same truth can be measured with other noise or turbulence."""

import zlib
from typing import Annotated

import numpy as np

from oio.core.settings import Within, settings


@settings
class Seeds:
    """Seeds of the three streams; by default all are `seed`, and the streams are independent of each other all the same."""

    truth: Annotated[int, Within(0, 2**63)]  # places, strengths, wind, spread of specimens, encoder drift
    disturbance: Annotated[int, Within(0, 2**63)]  # turbulence
    measurement: Annotated[int, Within(0, 2**63)]  # sensor noise

    def rng(self, stream: str, purpose: str) -> np.random.Generator:
        """The generator of one purpose in one stream; a new purpose does not shift the numbers of another."""
        return np.random.default_rng([getattr(self, stream), zlib.crc32(stream.encode()), zlib.crc32(purpose.encode())])
