"""What an arm says of its joints at one time."""

from dataclasses import dataclass

from oio.core.records import Array


@dataclass(frozen=True, slots=True, eq=False)
class JointReading:
    """All joints of an arm, n of them, in the order of its model."""

    q: Array  # (n,) rad, or m of a slide
    load: Array  # (n,) fraction of full load, -1 to 1; NaN where unknown
    temperature_degc: Array  # (n,); NaN where unknown
    fault: str | None = None  # that stops the arm
    t_ns: int | None = None  # time of the measurement [ns, world clock]; None: halfway between question and answer
    is_plausible: bool = True  # False: q is none of the arm's; it is neither logged, nor a pose to be held
