"""Registration of the environments; gymnasium is an optional extra, and only imported here and below."""

from oio.core.errors import BadInput

ENVIRONMENTS = {"OIO/Search-v0": "oio.gym.search_env:SearchEnv", "OIO/Calibrate-v0": "oio.gym.calibrate_env:CalibrateEnv"}


def register_environments() -> None:
    """Register what is not registered yet. Raises BadInput without gymnasium."""
    try:
        from gymnasium.envs.registration import register, registry
    except ModuleNotFoundError:
        raise BadInput("oio.gym was imported, but gymnasium is not installed. Type pip install 'oio[gym]'.") from None
    for name, entry_point in ENVIRONMENTS.items():
        if name not in registry:
            register(name, entry_point=entry_point)
