"""Q and R from the two uncertainties, in both assemblies; everything that was learnt goes to calibration.yaml."""

from dataclasses import replace
from typing import ClassVar

from oio.core.records import seconds
from oio.core.settings import settings
from oio.gas.range_law import RangeLaw
from oio.inference.model_selection import law_form
from oio.inference.prior import Nominal, Prior, calibrated_prior, cold_prior
from oio.inference.process_noise import ProcessNoise
from oio.inference.uncertainty import Noise, assemble_q_r
from oio.kinematics.arm import Arm
from oio.results.calibration import BaselineResult, BoutCalibration, Calibration, MapCalibration
from oio.results.calibration_file import calibration_yaml
from oio.results.verdict import Criteria, judge
from oio.runtime.context import Context


@settings
class AssembleQR:
    """Makes what the filters start from."""

    needs: ClassVar[tuple[type, ...]] = (BaselineResult, BoutCalibration, MapCalibration)
    assembly: str  # gum, or paper: which of the two the search uses
    arm: Arm
    range_law: RangeLaw
    process_noise: ProcessNoise
    nominal: Nominal
    verdict: Criteria
    holds_for: dict[str, str | None]  # names of sensor, its serial number, arm, profile and air: calibration= checks them

    def run(self, context: Context) -> Calibration:
        """Both assemblies, and the cold start to compare with."""
        bouts, found, base = context.need(BoutCalibration), context.need(MapCalibration), context.need(BaselineResult)
        noises = {name: assemble_q_r(name, bouts.last.u_a_ppm, found.type_b) for name in ("gum", "paper")}
        calibration = Calibration(
            chosen=self._knowledge(found, noises[self.assembly]),
            paper=self._knowledge(found, noises["paper"]),
            cold=cold_prior(self.arm, self.range_law, self.process_noise, self.nominal),
            cold_open=cold_prior(self.arm, self.range_law, self.process_noise, self.nominal, pinned=False),
            noise=noises[self.assembly],
            time_s=seconds(found.ended_ns - base.began_ns),
            error_ppm=found.error_ppm,
            u_a_ppm=bouts.last.u_a_ppm,
            u_b_m=found.type_b.u_b_m,
            moves=found.moves + sum(rung.moves for rung in bouts.rungs),
            baselines=base.elements,
            highest_ppm=found.highest_ppm,
        )
        held, verdict = (
            {**self.holds_for, "serial": self.holds_for["serial"] or context.world.sensor_serial},
            judge(context.results, self.verdict),
        )
        text = calibration_yaml(calibration, bouts, found, noises, held, context.world.made, verdict, context.world.t_ns)
        (context.out / "calibration.yaml").write_text(text, encoding="utf-8")
        context.log.attach("calibration.yaml", text.encode())
        figure = f"u_a {calibration.u_a_ppm:.2f} ppm, u_b {1e3 * calibration.u_b_m:.1f} mm"
        context.log.progress(context.world.t_ns, f"assembly={self.assembly}, air={law_form(found.fit)}", figure)
        return calibration

    def _knowledge(self, found: MapCalibration, noise: Noise) -> Prior:
        return calibrated_prior(found.fit, self.arm, self.process_noise, replace(self.nominal, delay_s=found.delay.s), noise)
