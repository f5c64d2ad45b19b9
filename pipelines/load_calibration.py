"""Begin with a calibration that was kept, instead of making one: what lasts is taken from its file, what does not is open again."""

from dataclasses import replace
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np

from oio.core.errors import BadInput
from oio.core.settings import Within, settings
from oio.gas.bouts import ElementBaseline
from oio.gas.range_law import RangeLaw
from oio.inference.map_fit import Fit
from oio.inference.prior import Nominal, Prior, calibrated_prior, cold_prior, nominal_prior
from oio.inference.process_noise import ProcessNoise
from oio.kinematics.arm import Arm
from oio.results.calibration import BaselineResult, Calibration, Kept
from oio.results.kept_calibration import KeptCalibration, read_kept
from oio.runtime.context import Context

JOINTS = ("nominal", "kept")


@settings
class LoadCalibration:
    """Sensor and air are as the file has them. Offsets are those of this run's baseline, or open to the data sheet's accuracy; encoders
    are as uncertain as before calibration, unless the arm was not switched off since (`joints: kept`)."""

    needs: ClassVar[tuple[type, ...]] = ()
    path: str | None  # None: no calibration= was typed, and the stage is in no run
    assembly: str
    joints: str
    good_for_days: Annotated[float, Within(0, 1e5)]  # an older calibration is remarked on
    arm: Arm
    range_law: RangeLaw
    process_noise: ProcessNoise
    nominal: Nominal
    holds_for: dict[str, str | None]

    def check(self) -> None:
        """Raise BadInput for a file that cannot be read or does not fit, before anything moves."""
        if self.joints not in JOINTS:
            given = f"load_calibration.joints is '{self.joints}'"
            raise BadInput(f"{given}, but it can be {' or '.join(JOINTS)}. Type load_calibration.joints={JOINTS[0]}.")
        if self.path is None:
            return
        kept, elements = self.kept, self.nominal.elements
        if kept.delay.s < 0.0:
            made = (
                f"{self.path} is of a log whose positions were stamped {-kept.delay.s:.2f} s late, but a run stamps joints as it reads them"
            )
            raise BadInput(f"{made}. Calibrate on this bench.")
        if kept.holds_for["sensor"] != self.holds_for["sensor"] or len(kept.baselines) != elements:
            made = f"{self.path} holds for sensor={kept.holds_for['sensor']} with {len(kept.baselines)} elements"
            this = f"this run has sensor={self.holds_for['sensor']} with {elements}"
            raise BadInput(f"{made}, but {this}. Type sensor={kept.holds_for['sensor']}, or calibrate again.")
        self._refuse_other_sensor(kept.serial, self.holds_for["serial"])

    @cached_property
    def kept(self) -> KeptCalibration:
        """The file, read once."""
        assert self.path is not None  # `build` sees to it
        return read_kept(self.path, self.arm, self.range_law)

    def run(self, context: Context) -> Calibration:
        """Raises BadInput for the calibration of another sensor, by a serial number that was told in the run; the file itself was checked
        when the stage was built."""
        kept, fresh = self.kept, context.results.get(BaselineResult)
        baselines = fresh.elements if isinstance(fresh, BaselineResult) else None
        fit = self._today(kept.fit, baselines)
        nominal = replace(self.nominal, delay_s=kept.delay.s)
        priors = {name: calibrated_prior(fit, self.arm, self.process_noise, nominal, noise) for name, noise in kept.noises.items()}
        serial = self.holds_for["serial"] or context.world.sensor_serial
        self._refuse_other_sensor(kept.serial, serial)
        remarks = self._remarks(baselines is not None, context.world.made, serial)
        (context.out / "calibration.yaml").write_text(kept.text, encoding="utf-8")
        context.log.attach("calibration.yaml", kept.text.encode())
        context.log.progress(context.world.t_ns, f"calibration={self.path}", " ".join(remarks) or "fits this run")
        return Calibration(
            priors[self.assembly], priors["paper"], self._cold(), self._cold(pinned=False), kept.noises[self.assembly], kept.time_s,
            kept.error_ppm, kept.u_a_ppm, kept.u_b_m, kept.moves, baselines or kept.baselines, kept.highest_ppm,
            Kept(kept.file, kept.verdict, remarks),
        )  # fmt: skip

    def _cold(self, pinned: bool = True) -> Prior:
        return cold_prior(self.arm, self.range_law, self.process_noise, self.nominal, pinned)

    def _today(self, fit: Fit, baselines: tuple[ElementBaseline, ...] | None) -> Fit:
        """The fit with what does not last open again: offsets of the elements, and the encoders."""
        lay, mean, cov = fit.layout, np.array(fit.mean), np.array(fit.cov)
        offsets = mean[lay.baseline] if baselines is None else np.array([b.ppm for b in baselines])
        offsets_u = np.full(lay.elements, self.nominal.accuracy_ppm) if baselines is None else np.array([b.u_ppm for b in baselines])
        opened_mean, opened_cov = nominal_prior(self.arm, self.range_law, self.nominal, offsets, offsets_u)
        for block in (lay.baseline, *((lay.offset, lay.drift) if self.joints == "nominal" else ())):
            cov[block, :], cov[:, block] = 0.0, 0.0
            mean[block], cov[block, block] = opened_mean[block], opened_cov[block, block]
        return replace(fit, mean=mean, cov=cov)

    def _refuse_other_sensor(self, was: str | None, this_one: str | None) -> None:
        if None not in (was, this_one) and was != this_one:
            made = f"{self.path} holds for the sensor with serial number '{was}', but this run has sensor_serial='{this_one}'"
            raise BadInput(f"{made}. Give the calibration of that sensor, or calibrate this one.")

    def _remarks(self, baseline_taken: bool, now: dict[str, object], this_one: str | None) -> tuple[str, ...]:
        """Where the file may not fit; `now` is when this world began, and its devices; `this_one`: serial number of this sensor."""
        held, devices = self.kept.holds_for, now["devices"]
        other = [
            f"{key} was {held[key]} and is {self.holds_for[key]} now." for key in ("profile", "air") if held[key] != self.holds_for[key]
        ]
        bad = [] if self.kept.verdict == "PASS" else [f"its own verdict was {self.kept.verdict}."]
        old = [] if baseline_taken else ["no baseline was taken today: put warm_up and baseline before navigate."]
        parts = (
            [] if devices == self.kept.made.devices else [f"devices were {_named(self.kept.made.devices)} and are {_named(devices)} now."]
        )
        began = now["started"]
        was = self.kept.serial
        which = [] if was == this_one else [f"it holds for sensor_serial={was or 'null'} and this run has {this_one or 'null'}."]
        days = self.kept.made.days_before(began if isinstance(began, str) else None)
        aged = [] if days is None or days <= self.good_for_days else [f"it is {days:.0f} days old, {self.good_for_days:g} are good."]
        return (*bad, *other, *which, *parts, *aged, *old)


def _named(devices: object) -> str:
    return ", ".join(f"{key} '{said}'" for key, said in devices.items()) if isinstance(devices, dict) and devices else "none"
