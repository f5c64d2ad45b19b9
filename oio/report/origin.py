"""Where the readings of a run come from: simulated, measured, recorded or replayed; when, with which sensor, gas and devices."""

import json

from oio.report.material import Material

KINDS = {
    "mujoco": "SIMULATED: no gas and no arm were there.",
    "serial": "MEASURED on a bench.",
    "recording": "RECORDED elsewhere and played: nothing can be measured again.",
    "replay": "REPLAYED from the log of another run.",
}


def is_recorded(material: Material) -> bool:
    """Whether nothing can be measured again."""
    return material.identity.get("backend") in ("recording", "replay")


def origin(material: Material) -> str:
    """Return one line on the origin."""
    told, sensor = material.identity, material.config.get("sensor") or {}
    kind = KINDS.get(told.get("backend", ""), f"backend={told.get('backend')}.")
    elements = sensor.get("elements")
    gas = f"{elements} {'element' if elements == 1 else 'elements'}, {sensor.get('gas')}" if sensor else "gas unknown"
    recording = (material.config.get("recording") or {}).get("name") if told.get("backend") == "recording" else None
    told_of = f" Recording {recording}." if recording else ""
    parts = [f"{kind}{told_of} Sensor {told.get('sensor')} ({gas}), arm {(material.config.get('arm') or {}).get('name')}"]
    parts += [f"air {told['air']}"] if told.get("backend") == "mujoco" and "air" in told else []
    parts += [f"begun {told['started']}"] if "started" in told else []
    devices = json.loads(told.get("devices", "{}"))
    parts += ["; ".join(f"{key}: {said or 'said nothing of itself'}" for key, said in devices.items())] if devices else []
    return ", ".join(parts) + "."
