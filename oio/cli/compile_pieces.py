"""`python -m oio.cli.compile_pieces PIECE`: have one part of the mathematics compiled, by a first use on made-up readings.

`oio.cli.first_compile` runs all pieces at once, each in a process of its own, which together fill the cache of compiled functions.
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from oio.core import startup

startup.handle_signals(__name__)

from hydra.utils import instantiate

from oio.cli.compose import compose
from oio.core.folders import ROOT
from oio.core.records import GasReading, JointState, nanoseconds
from oio.estimators.odometry import Odometry
from oio.gas.range_law import LAW, concentration
from oio.inference.beacon_fit import beacon_problem
from oio.inference.map_fit import Fit, solve
from oio.inference.prior import cold_prior
from oio.inference.rise_and_fall import rise_and_fall
from oio.kinematics.arm import Arm
from oio.search.view import View

FOR_S, EVERY_S = 12.0, 0.1  # of readings; half of them before a filter begins
SIGMA_PPM = 0.2  # of a reading


class Example:
    """The default experiment, and readings that an arm in motion might have taken."""

    @cached_property
    def _cfg(self) -> Any:
        return compose([], ()).cfg

    def part(self, key: str) -> Any:
        """What the configuration builds of a key."""
        return instantiate(self._cfg[key], _convert_="all")

    @cached_property
    def arm(self) -> Arm:
        """The arm."""
        return self.part("arm")  # type: ignore[no-any-return]

    @cached_property
    def odometry(self) -> Odometry:
        """Odometry without a calibration."""
        prior = cold_prior(self.arm, self.part("range_law"), self.part("process_noise"), self.part("nominal"), pinned=False)
        return Odometry(self.part("ekf"), prior, self.part("belief_map"))

    def sensed(self, begin_s: float, end_s: float) -> Iterator[JointState | GasReading]:
        """Joint states and readings, in order of time."""
        pace, still = np.linspace(0.3, 1.0, self.arm.dof), np.zeros(self.arm.dof)
        for t_s in np.arange(begin_s, end_s, EVERY_S):
            yield JointState(nanoseconds(t_s), self.arm.home + 0.1 * np.sin(pace * t_s), 0.1 * pace * np.cos(pace * t_s), still)
            yield GasReading(nanoseconds(t_s), 0, float(5.0 + 2.0 * np.sin(0.7 * t_s)), SIGMA_PPM)

    def feed(self, begin_s: float, end_s: float) -> None:
        """Give them to the odometry."""
        for sensed in self.sensed(begin_s, end_s):
            if isinstance(sensed, JointState):
                self.odometry.joints(sensed)
            else:
                self.odometry.reading(sensed)


def compile_filter() -> None:
    """The filter, prediction and update, and the move that it asks for."""
    example = Example()
    odometry = example.odometry
    example.feed(0.0, FOR_S / 2)
    known, model = odometry.prior, odometry.prior.model
    odometry.locate(1, made=(Fit(known.layout, known.mean, known.cov, 0.0, 1.0, model.fluctuation, 2, model.law),))
    example.feed(FOR_S / 2, FOR_S)
    odometry.nose()
    view = View(example.arm, odometry.model, odometry.belief, odometry.hypotheses, (), 1.0, 0.0, known.mean[:LAW])
    example.part("search").propose(view, np.random.default_rng(1))
    concentration(example.arm.nose(example.arm.home[None]), np.array(view.law), model.law.r_ref_m, model.law.radius_m)


def compile_map() -> None:
    """The belief map: grid, fits, and worlds that calibration did not see."""
    example = Example()
    example.feed(0.0, FOR_S)
    prior = example.odometry.prior
    swaying = replace(prior, model=replace(prior.model, fluctuation=replace(prior.model.fluctuation, sway=0.1)))
    readings, belief_map = example.odometry.trace.as_arrays(), example.part("belief_map")
    belief_map.as_calibrated.locate(readings, prior)
    belief_map.locate(readings, swaying)
    clean_air = np.zeros(example.part("nominal").elements), np.ones(example.part("nominal").elements)
    place = example.arm.nose(example.arm.home) + 0.1, 0.005
    beacon = beacon_problem(readings, example.arm, example.part("range_law"), example.part("nominal"), clean_air, place)
    rise_and_fall(beacon, solve(beacon, beacon.mean, swaying.model.fluctuation))


def compile_world() -> None:
    """Inverse kinematics, and the air of a simulation."""
    sys.path.insert(0, str(ROOT))  # the air is in `hardware`, beside `oio`
    example = Example()
    arm = example.arm
    arm.solve_ik(arm.nose(arm.home) + 0.01, arm.home)
    air = example.part("air").open(np.random.default_rng(1), np.random.default_rng(2))
    air.present(np.array([0.2, 0.0, 0.1]), 1.0)
    for _ in range(3):
        air.step(0.05)
        air.ppm(arm.nose(arm.home))


PIECES: dict[str, Callable[[], None]] = {"filter": compile_filter, "map": compile_map, "world": compile_world}

if __name__ == "__main__":
    PIECES[sys.argv[1]]()
