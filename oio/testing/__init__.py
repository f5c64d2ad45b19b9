"""Conformance tests, one per protocol, for our own plug-ins and for those of others: call one in a test of your package.

May import: `oio.search`, `oio.runtime` and below. May not import: results, the command line.
"""

from oio.testing.backends import check_backend, check_live_backend
from oio.testing.estimators import check_estimator
from oio.testing.sensors_and_air import check_air, check_sensor
from oio.testing.stages import check_stage
from oio.testing.strategies import check_strategy

__all__ = ["check_air", "check_backend", "check_estimator", "check_live_backend", "check_sensor", "check_stage", "check_strategy"]
