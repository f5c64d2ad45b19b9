"""Whatever is typed for a key of conf/, it is refused in one paragraph, or something is built that can be run; never a trace."""

import dataclasses
import functools
import math
import subprocess
import sys
from pathlib import Path

import pytest
from hydra.errors import InstantiationException
from hydra.utils import instantiate
from omegaconf import OmegaConf

from oio.cli.build import build
from oio.cli.hydra_errors import known_error
from oio.cli.typed_keys import as_typed, named
from oio.core.errors import BadInput
from oio.core.ranges import declared, holds_numbers

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[1]
CONF = ROOT / "conf"
VALUES = (0, -1, math.nan, math.inf, 1e308, "a", [1], None)
UNREAD = ("experiment", "hydra", "protocol", "recording")  # groups of overrides; and what needs a recording's or a protocol's own key
WITHOUT_RANGE = {}  # (class, field): why a number has no range


def choices():
    """Every choice that stands in one YAML, as a group of the root."""
    for group in sorted(path for path in CONF.iterdir() if path.is_dir() and path.name not in UNREAD):
        for path in sorted(group.glob("*.yaml")):
            node = OmegaConf.to_container(OmegaConf.load(path), resolve=False)
            if isinstance(node, dict) and "defaults" not in node and "@package" not in path.read_text(encoding="utf-8").splitlines()[0]:
                yield group.name, path.stem, node


CHOICES = {(group, name): node for group, name, node in choices()}


@pytest.fixture(scope="module")
def plain(composed):
    """The default configuration, unresolved."""
    return OmegaConf.to_container(composed(), resolve=False)


def with_choice(plain, group, name):
    """The default configuration with another choice of one group."""
    node = {key: "outputs/none" if value == "???" else value for key, value in CHOICES[group, name].items()}
    if group == "arm":
        node["dof"] = node["ladder"][-1]
    return {**plain, group: {name: node} if group == "stage" else node}


def own_fields(node, prefix):
    """Keys of a node and below, with the values that are not passed on: (node's key, field)."""
    for key, value in node.items():
        if isinstance(value, dict):
            yield from own_fields(value, f"{prefix}.{key}")
        if "_target_" in node and key != "_target_" and not str(value).startswith("${"):
            yield prefix, key


def set_in(plain, key, value):
    """A configuration with one key set."""
    first, _, rest = key.partition(".")
    return {**plain, first: set_in(plain[first], rest, value) if rest else value}


# ---- every class, every field, every value: as Hydra would make it


def nodes(made):
    """A settings object and all that it holds."""
    if dataclasses.is_dataclass(made):
        yield made
        for field in dataclasses.fields(made):
            yield from nodes(getattr(made, field.name))
    for inner in made.values() if isinstance(made, dict) else made if isinstance(made, tuple | list) else ():
        yield from nodes(inner)


def buildable(group, name):
    """Whether a choice is built without a file or a device of the user's own."""
    return (group, name) not in {("backend", "replay"), ("backend", "recording"), ("backend", "serial"), ("stage", "load_calibration")}


def made_of(plain, group, name):
    cfg = OmegaConf.create(with_choice(plain, group, name))
    return instantiate(cfg[group], _convert_="all")


@pytest.mark.parametrize(("group", "name"), [choice for choice in CHOICES if buildable(*choice)])
def test_every_field_refuses_or_takes_whatever_comes(plain, group, name):
    tried = 0
    for made in {id(node): node for node in nodes(made_of(plain, group, name))}.values():
        for field in dataclasses.fields(made):
            for value in VALUES:
                tried += 1
                try:
                    dataclasses.replace(made, **{field.name: value})
                except BadInput as refused:
                    assert "\n" not in str(refused), refused
    assert tried or group in ("profile", "view", "stage", "search")


def test_no_number_is_without_a_range(plain):
    """Of any class that conf/ reaches."""
    targets = {line.split("_target_:")[1].split(",")[0].split("#")[0].strip(" }\n") for path in CONF.rglob("*.yaml")
               for line in path.read_text(encoding="utf-8").splitlines() if "_target_:" in line}  # fmt: skip
    classes = {made for made in map(located, targets) if dataclasses.is_dataclass(made)}
    assert len(classes) > 80
    bare = {(made.__name__, field) for made in classes for field, allowed in declared(made).items() if allowed is None}
    assert bare == set(WITHOUT_RANGE)
    assert all(allowed.low <= allowed.high for made in classes for allowed in declared(made).values())


def located(target):
    module, _, name = target.rpartition(".")
    return getattr(__import__(module, fromlist=[name]), name)


def test_what_holds_numbers():
    assert holds_numbers(dict[str, tuple[float | None, ...]]) and holds_numbers(int | None)
    assert not holds_numbers(bool) and not holds_numbers(tuple[str, ...] | None)


# ---- every key as it is typed, through Hydra, to the paragraph that a person reads


def typed_fields(plain, *tops):
    """Every (key of a node, field) that has a class and a value of its own, below these keys of the root."""
    return [pair for top in tops or plain if isinstance(plain[top], dict) for pair in own_fields(plain[top], top)]


def refusal(cfg, plain, at, field, value):
    """What a person would read of a field of the node `at`; None if it is built. `plain` is `cfg` unresolved."""
    node, kept = OmegaConf.select(cfg, at), functools.reduce(lambda inner, part: inner[part], [*at.split("."), field], plain)
    node[field] = value
    try:
        instantiate(node, _convert_="all")
    except InstantiationException as error:
        known = named(error, plain)
        return str(known or error)
    finally:
        node[field] = kept
    return None


def said_well(said, field):
    return "\n" not in said and field in said and "full_key" not in said and "Error" not in said


def test_every_key_is_refused_under_its_name(plain):
    """One value for each key, in turn; all of them in the slow test below."""
    cfg = OmegaConf.create(plain)
    said = {f"{at}.{f}": refusal(cfg, plain, at, f, VALUES[i % len(VALUES)]) for i, (at, f) in enumerate(typed_fields(plain))}
    assert {key: text for key, text in said.items() if text and not said_well(text, key.rsplit(".", 1)[-1])} == {}
    assert sum(text is not None for text in said.values()) > len(said) / 2


@pytest.mark.slow
@pytest.mark.parametrize(("group", "name"), [choice for choice in CHOICES if buildable(*choice)])
def test_every_key_with_every_value(plain, group, name):
    changed = with_choice(plain, group, name)
    cfg = OmegaConf.create(changed)
    tried = [(at, f, v, refusal(cfg, changed, at, f, v)) for at, f in typed_fields(changed, group) for v in VALUES]
    assert [(at, f, v, text) for at, f, v, text in tried if text and not said_well(text, f)] == []


NEEDED = {"beacon.position": ("calibrate_bouts", "map_beliefs")}  # further stages that read a key
SCALARS = ("seed", "trials", "dof", "assembly", "report", "logging", "calibration", "sensor_serial", "beacon.position", "source.position")


@pytest.mark.parametrize("key", SCALARS)
def test_keys_of_the_root(plain, key):
    refused, short = 0, {**plain, "stage": {name: plain["stage"][name] for name in ("warm_up", "baseline", *NEEDED.get(key, ()))}}
    for value in VALUES:
        try:
            build(OmegaConf.create(set_in(short, key, value)), {"backend": "mujoco", "air": "draft", "ekf": "ekf"}, [])
        except (BadInput, InstantiationException) as error:
            known = known_error(error, CONF)
            assert isinstance(known, BadInput) and "\n" not in str(known) and "Error" not in str(known), str(known)
            refused += 1
    assert refused or key == "sensor_serial"


# ---- what is built can be run


def taken(plain):
    """Every 40th of the keys and values of the default configuration, of those that are built."""
    cfg, pairs = OmegaConf.create(plain), [(at, f, v) for at, f in typed_fields(plain) for v in (0, -1, 1e308, "a", None)]
    return [(f"{at}.{f}", v) for at, f, v in pairs[::40] if refusal(cfg, plain, at, f, v) is None]


@pytest.mark.slow
def test_what_is_built_can_be_run(plain, tmp_path):
    """A sample of the values that are taken, in short runs."""
    failed = []
    for i, (key, value) in enumerate(taken(plain)):
        words = [f"{key}={as_typed(value)}", "stage=[warm_up,baseline]", "report=false", f"hydra.run.dir={tmp_path / str(i)}"]
        ended = subprocess.run(
            [sys.executable, "-m", "oio.run", *words], cwd=ROOT, capture_output=True, text=True, timeout=300, check=False
        )
        if ended.returncode not in (0, 1, 2, 3) or "Traceback" in ended.stderr:
            failed.append((words[0], ended.returncode, ended.stderr[-500:]))
    assert failed == []
