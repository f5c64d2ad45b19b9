"""What was recorded, as arrays: `Readings` of the gas sensor, and where the nose was (`JointPath` of an arm, or `NosePath`)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from oio.api import array_input
from oio.core.errors import BadInput
from oio.core.interfaces import Sensor
from oio.core.records import Array, GasReading, GasSample, nanoseconds
from oio.tabular.positions import LOST, lost_places

SCALE_END, NO_VALUE = "at the upper end of the sensor's scale or beyond", "the sensor's sign for no measurement (sensor.no_value)"


@dataclass(frozen=True, eq=False)
class Readings:
    """Readings of a gas sensor: times t_s (m,) [s], and either ppm (m,) or raw (m,) in the unit of the sensor (see conf/sensor).

    `element`: index of the sensor's element of each reading (m,), or one for all. `sigma_ppm`: standard uncertainty of white noise of one
    reading (m,), or one for all; None: as the data sheet has it. Raises BadInput for other shapes, for what is not finite, for times that
    decrease or are negative.
    """

    t_s: ArrayLike
    ppm: ArrayLike | None = None
    raw: ArrayLike | None = None
    element: ArrayLike = 0
    sigma_ppm: ArrayLike | None = None

    def __post_init__(self) -> None:
        t_s = array_input.times("Readings.t_s", self.t_s, equal=True)
        n = len(t_s)
        if (self.ppm is None) == (self.raw is None):
            given = "neither ppm nor raw" if self.ppm is None else "both ppm and raw"
            raise BadInput(f"Readings was given {given}, but it takes one of them, of shape ({n},).")
        for name in ("ppm", "raw", "sigma_ppm"):
            value = getattr(self, name)
            if value is not None:
                value = np.full(n, value) if name == "sigma_ppm" and np.ndim(value) == 0 else value
                object.__setattr__(self, name, array_input.vector(f"Readings.{name}", value, n))
        if self.sigma_ppm is not None and np.any(np.asarray(self.sigma_ppm) <= 0.0):
            raise BadInput(
                "Readings.sigma_ppm has values of 0 or less, but a standard uncertainty is greater than 0. Leave it out, or give it."
            )
        object.__setattr__(self, "t_s", t_s)
        object.__setattr__(self, "element", array_input.elements("Readings.element", self.element, n))

    def __len__(self) -> int:
        return len(np.asarray(self.t_s))

    def between(self, begin_s: float, end_s: float) -> Self:
        """Return the readings with begin_s < t <= end_s. Raises BadInput if there are none."""
        return self.only(_within(np.asarray(self.t_s), begin_s, end_s, "reading"))

    def only(self, kept: NDArray[np.bool_]) -> Self:
        """Return some of the readings, those of a mask (m,). Raises BadInput if there are none."""
        if not np.any(kept):
            raise BadInput("none of the readings is left. Give those of a longer time.")
        return replace(self, **{k: np.asarray(v)[kept] for k, v in vars(self).items() if v is not None})

    def records(self, sensor: Sensor, sigma_ppm: float) -> list[GasReading]:
        """Return them as the filter takes them; what is no measurement is left out (see `no_measurement`).

        `sigma_ppm` is that of one reading where none was given. Raises BadInput for an element that the sensor has not.
        """
        check_element(int(np.asarray(self.element).max()), sensor)
        values = np.asarray(self.raw if self.ppm is None else self.ppm)
        sigmas = np.full(len(self), sigma_ppm) if self.sigma_ppm is None else np.asarray(self.sigma_ppm)
        rows = zip(np.asarray(self.t_s).tolist(), np.asarray(self.element).tolist(), values.tolist(), sigmas.tolist(), strict=True)
        return [
            GasReading(nanoseconds(t_s), element, value, sigma)
            if self.ppm is not None
            else sensor.reading(GasSample(nanoseconds(t_s), element, value))
            for (t_s, element, value, sigma), why in zip(rows, self.no_measurement(sensor), strict=True)
            if why is None
        ]

    def no_measurement(self, sensor: Sensor) -> list[str | None]:
        """Return why each reading (m,) is no measurement, None where it is one."""
        values = np.asarray(self.raw if self.ppm is None else self.ppm).tolist()
        return [no_measurement(sensor, value if self.ppm is None else sensor.raw(value)) for value in values]


def no_measurement(sensor: Sensor, raw: float) -> str | None:
    """Return why a raw value is no measurement: the upper end of the scale, or the device's own sign for none; None if it is one."""
    if raw >= sensor.highest_raw:
        return SCALE_END
    is_no_value: Callable[[float], bool] | None = getattr(sensor, "is_no_value", None)  # a sensor of one's own may have no such values
    return NO_VALUE if is_no_value is not None and is_no_value(raw) else None


def check_element(element: int, sensor: Sensor) -> None:
    """Raise BadInput for an element that the sensor has not."""
    if not 0 <= element < sensor.elements:
        raise BadInput(f"element {element} was given, but sensor '{sensor.name}' has {sensor.elements}: 0 to {sensor.elements - 1}.")


@dataclass(frozen=True, eq=False)
class JointPath:
    """Joints of an arm: times t_s (k,) [s], strictly increasing, and encoder positions q (k, n) of the n unlocked joints, base first, in
    rad (m for joints that slide). Raises BadInput for other shapes, for what is not finite, for times out of order."""

    t_s: ArrayLike
    q: ArrayLike

    def __post_init__(self) -> None:
        t_s = array_input.times(f"{type(self).__name__}.t_s", self.t_s)
        object.__setattr__(self, "t_s", t_s)
        object.__setattr__(self, "q", array_input.matrix(f"{type(self).__name__}.{self._what}", self.q, len(t_s), self._columns))

    _what, _columns = "q", None

    def between(self, begin_s: float, end_s: float) -> Self:
        """Return the part with begin_s < t <= end_s. Raises BadInput if there is none."""
        kept = _within(np.asarray(self.t_s), begin_s, end_s, "pose")
        return type(self)(np.asarray(self.t_s)[kept], np.asarray(self.q)[kept])

    def at(self, t_ns: Array) -> tuple[Array, Array]:
        """Times (j,) [ns] and positions (j, n) of this path, with further times (i,) [ns] inside it, where it is interpolated."""
        own = np.rint(np.asarray(self.t_s) * 1e9)
        nodes = np.union1d(own, t_ns)
        return nodes, np.stack([np.interp(nodes, own, joint) for joint in np.asarray(self.q).T], axis=1)


class NosePath(JointPath):
    """Positions of a nose without an arm (by hand, on a gantry, on a robot that knows where it is): times t_s (k,) [s] and p_m (k, 3) [m]
    in any frame that stands still."""

    _what, _columns = "p_m", 3  # type: ignore[assignment]

    def __init__(self, t_s: ArrayLike, p_m: ArrayLike) -> None:
        super().__init__(t_s, p_m)
        farthest_m = float(np.max(np.abs(np.asarray(self.q))))
        if farthest_m > array_input.FARTHEST_M:
            raise BadInput(
                f"NosePath.p_m has values up to {farthest_m:g}, but m are wanted, {array_input.FARTHEST_M:g} at most. Divide mm by 1000."
            )
        if np.any(lost := lost_places(np.asarray(self.t_s), np.asarray(self.q))):
            at_s = float(np.asarray(self.t_s)[lost][0])
            raise BadInput(
                f"NosePath.p_m is 0, 0, 0 in {np.count_nonzero(lost)} rows, the first at {at_s:g} s, {LOST}. Leave these rows out, and the "
                f"readings until the place is known again."
            )


def _within(t_s: Array, begin_s: float, end_s: float, what: str) -> NDArray[np.bool_]:
    kept = np.asarray((t_s > begin_s) & (t_s <= end_s))
    if not np.any(kept):
        raise BadInput(f"there is no {what} from {begin_s:g} to {end_s:g} s; there are some from {t_s[0]:g} to {t_s[-1]:g} s.")
    return kept
