"""LeRobot's registry of robots: from the name of a type to its configuration and to the robot."""

import dataclasses
import importlib
import pkgutil
from typing import Any

from hardware.drivers.robots.foreign_call import foreign_call, told
from hardware.drivers.robots.lerobot_options import LerobotOptions
from oio.core.errors import BadInput

INSTALL = "Install it: pip install 'oio[lerobot]' (LeRobot of today wants Python 3.12)."


def configuration(options: LerobotOptions, port: str, torque_off_at_end: bool) -> Any:
    """Return the configuration of a robot, in degrees where that can be chosen, and with joints that hold at its end, unless the user
    wants them to let go. Raises BadInput."""
    if options.type is None or options.id is None:
        raise BadInput(
            "backend.arm.driver=lerobot needs the words with which the arm was calibrated. Type e.g. "
            "backend.arm.lerobot.type=so101_follower backend.arm.lerobot.id=my_arm."
        )
    made = config_class(options.type)
    fields = {field.name for field in dataclasses.fields(made)}
    own = {"port": port, "use_degrees": True, "disable_torque_on_disconnect": torque_off_at_end}
    given = {"id": options.id, **{key: value for key, value in own.items() if key in fields}, **(options.options or {})}
    unknown = sorted(given.keys() - fields)
    if unknown:
        raise BadInput(
            f"backend.arm.lerobot.options has {unknown[0]}, but LeRobot's {options.type} has no such field; it has "
            f"{', '.join(sorted(fields))}."
        )
    try:
        return made(**given)
    except Exception as error:
        raise BadInput(f"LeRobot refuses the configuration of {options.type}: {told(error)}.") from error


def config_class(kind: str) -> Any:
    """Return the configuration class that is registered as `kind`. Raises BadInput if LeRobot, or such a robot, is not there."""
    robots = _imported()
    registry, failed = robots.RobotConfig, list[str]()
    if kind not in registry.get_known_choices():  # a robot is registered when its module is imported
        failed = _import_all(robots)
    known = registry.get_known_choices()
    if kind not in known:
        broken = f" These could not be imported: {'; '.join(failed)}." if failed else ""
        raise BadInput(f"backend.arm.lerobot.type={kind} was given, but LeRobot has {', '.join(sorted(known)) or 'none'}.{broken}")
    return registry.get_choice_class(kind)


def make_robot(config: Any) -> Any:
    """Return LeRobot's robot of a configuration."""
    return _imported().make_robot_from_config(config)


def _imported() -> Any:
    try:
        return importlib.import_module("lerobot.robots")
    except (ImportError, OSError) as error:
        raise BadInput(f"backend.arm.driver=lerobot was given, but LeRobot cannot be imported: {told(error)}. {INSTALL}") from None


def _import_all(robots: Any) -> list[str]:
    """Import every robot of LeRobot and of its plug-ins; return those that cannot be, for want of a maker's library."""
    failed = []
    for name in [f"lerobot.robots.{found.name}" for found in pkgutil.iter_modules(robots.__path__) if found.ispkg]:
        try:
            importlib.import_module(name)
        except Exception as error:
            failed.append(f"{name}: {told(error)}")
    tools = importlib.import_module("lerobot.utils.import_utils")
    register = getattr(tools, "register_third_party_plugins", None) or getattr(tools, "register_third_party_devices", None)
    if register is not None:
        foreign_call("LeRobot's register_third_party_plugins()", register)
    return failed
