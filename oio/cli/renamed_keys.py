"""Configuration keys that were renamed: an old one is refused with the new name; in an old log it is translated."""

RENAMED = {
    "range": "range_law",
    "range.air": "range_law.form",
    "range.nose_u_m": "range_law.nose_jitter_m",
    "range.nose_choices_m": "range_law.nose_jitter_choices_m",
    "range.stray": "range_law.model_discrepancy",
    "range.stray_choices": "range_law.model_discrepancy_choices",
    "range.usual_nose_u_m": "range_law.typical_nose_jitter_m",
    "range.usual_stray": "range_law.typical_model_discrepancy",
    "range.calm_evidence": "range_law.calm_min_evidence",
    "range.gamma": "range_law.fluctuation_intensity",
    "wander": "process_noise",
    "wander.still_rad_s": "process_noise.rest_speed_rad_s",
    "room": "climate",
    "beacon.near_m": "beacon.approach_m",
    "source.near_m": "source.approach_m",
    "stop.near_m": "stop.sniff_radius_m",
    "stop.sniffs": "stop.min_sniffs",
    "stop.nis": "stop.max_nis",
    "bout.above": "bout.threshold",
    "belief_map.coarse": "belief_map.grid_points",
    "belief_map.shell": "belief_map.points_per_shell",
    "belief_map.apart_m": "belief_map.min_separation_m",
    "process_noise.still_rad_s": "process_noise.rest_speed_rad_s",
    "ekf.settled_sigmas": "ekf.convergence_sigmas",
    "ekf.least_weight": "ekf.min_weight",
    "ekf.each": "ekf.component_filter",
    "search.misfit": "search.model_discrepancy",
    "search.zooms": "search.refinements",
    "search.around": "search.local_candidates",
    "search.anywhere": "search.random_candidates",
    "search.far_sd_m": "search.random_above_sd_m",
    "search.fold_rad": "search.ik_start_spread_rad",
    "search.latest": "search.fit_sniffs",
    "search.least": "search.min_step",
    "search.shrink": "search.step_factor",
    "search.widen": "search.cast_growth",
    "search.widest": "search.max_cast",
    "search.fade": "search.threshold_decay",
    "search.curiosity": "search.exploration_bonus",
    "air.stood_s": "air.spin_up_s",
    "safety.quiet_s": "safety.heartbeat_timeout_s",
    "safety.stale_s": "safety.command_age_s",
    "backend.hold_s": "backend.reorder_s",
    "backend.arm.release": "backend.arm.torque_off_at_end",
    "backend.patience": "backend.timeouts",
    "backend.patience.first_s": "backend.timeouts.connect_s",
    "backend.patience.silent_s": "backend.timeouts.receive_s",
    "backend.patience.away_s": "backend.timeouts.reconnect_s",
    "backend.patience.backoff_most_s": "backend.timeouts.backoff_max_s",
    "backend.arm.astray_deg": "backend.arm.tracking_error_deg",
    "backend.arm.astray_s": "backend.arm.tracking_error_s",
    "stage.navigate.explore": "stage.navigate.mapping.explore_moves",
    "stage.navigate.smelt": "stage.navigate.mapping.min_whiffs",
    "stage.navigate.explore_most": "stage.navigate.mapping.explore_max_moves",
    "stage.navigate.lost": "stage.navigate.mapping.lost_moves",
    "stage.navigate.remap": "stage.navigate.mapping.remap_factor",
    "stage.navigate.recheck": "stage.navigate.mapping.recheck_moves",
    "stage.navigate.smelt_sigmas": "stage.navigate.whiff_sigmas",
    "stage.navigate.near_m": "stage.navigate.standoff_m",
    "stage.navigate.estimator": "stage.navigate.ekf",
    "stage.navigate.strategy": "stage.navigate.search",
    "stage.navigate.rule": "stage.navigate.bout",
    "stage.calibrate_bouts.rule": "stage.calibrate_bouts.bout",
    "stage.evaluate.estimator": "stage.evaluate.ekf",
    "stage.map_beliefs.law": "stage.map_beliefs.range_law",
    "stage.map_beliefs.wander": "stage.map_beliefs.process_noise",
    "stage.assemble_qr.law": "stage.assemble_qr.range_law",
    "stage.assemble_qr.wander": "stage.assemble_qr.process_noise",
}


def renamed(key: str) -> str | None:
    """What a key is called now, e.g. range_law.exponent for range.exponent; None if it never had another name."""
    parts = key.split(".")
    for count in range(len(parts), 0, -1):
        new = RENAMED.get(".".join(parts[:count]))
        if new is not None:
            return ".".join([new, *parts[count:]])
    return None


def modernised(override: str) -> str:
    """An override KEY=VALUE with the key as it is called now."""
    key, equals, value = override.partition("=")
    return f"{renamed(key) or key}{equals}{value}"
