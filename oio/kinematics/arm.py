"""The arm: its model file, DoF ladder, rest pose, speeds and encoder errors; the same for real and simulated arms."""

from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np

from oio.core.errors import BadInput
from oio.core.folders import ROOT
from oio.core.records import Array
from oio.core.settings import Within, settings
from oio.kinematics.chain_from_model import KinematicChain, NosePoint, load_chain
from oio.kinematics.forward import SLIDE
from oio.kinematics.homing import Homing
from oio.kinematics.homing_file import read_homing
from oio.kinematics.workspace import Workspace


@settings
class Arm(Workspace):
    """An arm: which model file, how its degrees of freedom are unlocked, where it rests, and how fast it may go.

    Joints beyond `dof` are locked (braked) at `home_rad`; every vector of joints in OIO has the `dof` unlocked ones only.
    """

    name: str
    mjcf: str  # path of the model, MJCF or URDF, relative to the folder that holds `oio/`
    nose_site: str  # the site of an MJCF where the nose is,
    nose_body: str | None  # or, if it is given, the nose is on this body (the only way in a URDF),
    nose_offset_m: Annotated[tuple[float, float, float], Within(-2, 2)]  # here in the frame of that body
    # element_places_m: of a sensor with two elements, each from the nose and in its frame (zero: both are at the nose),
    element_places_m: Annotated[tuple[tuple[float, float, float], tuple[float, float, float]], Within(-0.5, 0.5)]
    element_spacing_m: Annotated[float, Within(0, 0.5)]  # and so far apart besides, along the y axis of that frame, the first on its + side
    dof: Annotated[int, Within(1, 100)]  # how many joints move, a rung of the ladder
    # ladder: rungs in the order of calibration; None: 1, 2, 3 and all joints, as the paper's 1, 2, 3, 5
    ladder: Annotated[tuple[int, ...] | None, Within(1, 100)]
    home_rad: Annotated[tuple[float, ...], Within(-100, 100)]  # rest pose, all joints
    # box_low_m: the nose stays in this box (table, base, person) in the base frame
    box_low_m: Annotated[tuple[float, float, float], Within(-100, 100)]
    box_high_m: Annotated[tuple[float, float, float], Within(-100, 100)]
    joint_speed: Annotated[float, Within(1e-3, 100)]  # rad/s (m/s for slides)
    nose_speed_m_s: Annotated[float, Within(1e-3, 100)]  # m/s
    nose_limit_m_s: Annotated[float, Within(1e-3, 100)]  # m/s; `duration_s` plans by the chord, and on a curved path the nose is faster
    encoder_drift_deg_s2: Annotated[float, Within(0, 10)]  # bound on the encoders' quadratic drift
    homing_offset_deg: Annotated[float, Within(0, 90)]  # standard deviation of the homing offset
    # random_span_rad: random poses keep every joint this near to home, so that an arm whose joints turn all the way around is not asked to
    # fold over to another of its configurations, to which no path leads inside the box; None: anywhere within its limits
    random_span_rad: Annotated[float | None, Within(0.1, 10)]
    homing: str | None  # file of `python -m hardware.home`, or LeRobot's calibration; its uncertainties come on top
    backlash_deg: Annotated[float, Within(0, 90)]  # peak to peak

    def check(self) -> None:
        """Refuse a DoF off the ladder, a box with swapped corners, a home of the wrong length or out of limits."""
        if self.dof not in self.rungs:
            rungs = ", ".join(map(str, self.rungs))
            raise BadInput(f"dof={self.dof} is not on the ladder of arm '{self.name}'. It can be {rungs}. Type e.g. dof={self.rungs[-1]}.")
        if list(self.rungs) != sorted({*self.rungs}) or self.rungs[-1] > len(self.all_names):
            given = f"arm.ladder is {list(self.rungs)}, but its rungs must rise, from 1 at least to the {len(self.all_names)} joints of"
            raise BadInput(f"{given} {self.mjcf}. Type arm.ladder=null for 1, 2, 3 and all.")
        if len(self.home_rad) != len(self.all_names):
            raise BadInput(f"arm.home_rad has {len(self.home_rad)} values, but {self.mjcf} has {len(self.all_names)} joints.")
        if np.any(np.subtract(self.box_high_m, self.box_low_m) < 0):
            given = f"arm.box_low_m is {list(self.box_low_m)} and arm.box_high_m {list(self.box_high_m)}"
            raise BadInput(
                f"{given}, but none of the three numbers may be above the other's. Give the lower corner of the box, then the upper."
            )
        low, high = self.model.low, self.model.high
        home = np.array(self.home_rad)
        if np.any(home < low) or np.any(home > high):
            raise BadInput(f"arm.home_rad is {list(self.home_rad)}, but the limits are {low.tolist()} to {high.tolist()} rad.")
        if self.homing is not None:
            _ = self.homed  # a wrong file is refused now

    @cached_property
    def rungs(self) -> tuple[int, ...]:
        """Numbers of joints that may be unlocked, in the order of calibration."""
        return tuple(sorted({1, 2, 3, len(self.all_names)} & {*range(1, len(self.all_names) + 1)})) if self.ladder is None else self.ladder

    @property
    def path(self) -> Path:
        """The model file; a relative path is one of the project's own, or counts from the current folder. Raises BadInput if missing."""
        for path in (ROOT / self.mjcf, Path(self.mjcf).absolute()):
            if path.is_file():
                return path
        raise BadInput(f"arm.mjcf is {self.mjcf}, but there is no such file. Give the path of an MJCF or a URDF.")

    @property
    def nose_point(self) -> NosePoint:
        """Where the nose is in the model."""
        return NosePoint(self.nose_site, self.nose_body, self.nose_offset_m)

    @cached_property
    def model(self) -> KinematicChain:
        """All joints, as the model file has them."""
        return load_chain(self.path, self.nose_point)

    @cached_property
    def all_names(self) -> tuple[str, ...]:
        """Names of all joints, base to nose."""
        return self.model.names

    @cached_property
    def element_offsets_m(self) -> Array:
        """Where the sensor's elements are, from the nose and in its frame (2, 3) m; zero: all are at the nose."""
        apart = 0.5 * self.element_spacing_m * np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
        return np.array(self.element_places_m) + apart

    @cached_property
    def homed(self) -> Homing | None:
        """What the homing file, ours or LeRobot's, says of all joints; None without one."""
        return None if self.homing is None else read_homing(self.homing, self.model.low, self.model.high)

    @property
    def homing_u_deg(self) -> Array:
        """Standard uncertainty of the unlocked joints' zeros (n,) degrees."""
        read = self.homed
        return np.hypot(self.homing_offset_deg, np.zeros(self.dof) if read is None else np.array(read.u_deg[: self.dof]))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unlocked joints."""
        return self.all_names[: self.dof]

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of the position of each unlocked joint: rad of a hinge, m of a slide."""
        return tuple("m" if kind == SLIDE else "rad" for kind in self.model.kinds[: self.dof])

    @property
    def home(self) -> Array:
        """The rest pose of the unlocked joints (n,) rad."""
        return np.array(self.home_rad[: self.dof])

    @property
    def box_sd_m(self) -> float:
        """Standard deviation [m] of a place that is anywhere in the workspace box: rectangular on each axis (GUM 4.3.7)."""
        return float(np.linalg.norm(np.subtract(self.box_high_m, self.box_low_m)) / np.sqrt(12.0))

    @property
    def shoulder(self) -> Array:
        """Where the first joint sits (3,) m: bearings are seen from here."""
        return self.model.poses[0, :3, 3]
