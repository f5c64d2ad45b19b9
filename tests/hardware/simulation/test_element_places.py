"""Simulated elements feel the gas at their own places, in turn or together; at one place nothing changes, to the bit."""

import numpy as np
import pytest

from hardware.simulation.exposed_sensor import ExposedSensor
from oio.core.errors import BadInput
from oio.core.records import GasSample

STEADY = ("sensor=ec", "dof=5", "air=steady")


def exposed(backend, ticks=2):
    """A plant with its source open and the gas of the last tick, at the nose and at each element."""
    with backend.plant() as plant:
        plant.present("source")
        for _ in range(ticks):
            plant.tick(plant.encoders())
        return plant


def test_each_element_feels_the_gas_at_its_place(built):
    """At the nose, between them, the concentration is between theirs."""
    plant = exposed(built("backend", *STEADY, "arm.element_spacing_m=0.1"))
    air, places = plant._room, plant._nose_m() + plant._sensor.apart_m @ plant._site.xmat.reshape(3, 3).T
    np.testing.assert_allclose(plant._sensor.element_ppm, [air.ppm(p, None) for p in places], rtol=1e-3)
    assert plant._sensor.element_ppm[0] != plant._sensor.element_ppm[1]
    assert min(plant._sensor.element_ppm) < plant.truth().ppm < max(plant._sensor.element_ppm)


def test_the_gas_at_elements_follows_from_the_law_in_steady_air(built):
    """Simulation against model: the ratio of the pair is that of the distances r of its places by the arm's kinematics (backlash apart)."""
    backend = built("backend", *STEADY, "arm.element_spacing_m=0.1")
    plant = exposed(backend, 1)
    p, _ = backend.arm.element_jacobians(plant.truth().q[None], 2)
    r = np.linalg.norm(p[:, 0] - plant.truth().source_m, axis=1)
    signal = np.array(plant._sensor.element_ppm) - backend.background_ppm
    assert signal[0] / signal[1] == pytest.approx(r[1] / r[0], rel=0.05) and abs(np.log(r[1] / r[0])) > 0.3


@pytest.mark.parametrize("sampling", ["in_turn", "together"])
def test_elements_are_sampled_in_turn_or_together(built, sampling):
    with built("backend", *STEADY, f"backend.sampling={sampling}").open() as world:
        gas = [(s.t_ns, s.element) for s in world.samples(2.01) if isinstance(s, GasSample)]
    times = [t for t, _ in gas]
    expected = [0, 1] * 2 if sampling == "in_turn" else [0, 1] * 4
    assert [e for _, e in gas][: len(expected)] == expected
    assert len(set(times)) == (len(times) if sampling == "in_turn" else len(times) // 2)


def test_a_unit_that_feels_one_concentration_cannot_be_in_two_places(built):
    class Plain:
        def step(self, ppm, dt_s): ...

        def sample(self, element, t_s):
            return 0.0

    with pytest.raises(BadInput, match="element_spacing_m=0"):
        ExposedSensor(Plain(), built("arm", "arm.element_spacing_m=0.1").element_offsets_m, 0.0)
    ExposedSensor(Plain(), built("arm").element_offsets_m, 0.0)
