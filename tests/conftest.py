"""`built` composes conf/ with overrides, as a run would, and builds one key of it; `foreign_models` are model files of other arms."""

import copy
import functools
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hypothesis
import pytest
from hydra import compose, initialize_config_dir
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from oio.cli.first_compile import first_compile

os.environ.pop("COLUMNS", None)  # readline, which pytest imports, sets it for workers; where it matters a test sets it itself
hypothesis.settings.register_profile("patient", deadline=None)  # the first call compiles
hypothesis.settings.load_profile("patient")

CONF = Path(__file__).resolve().parents[1] / "conf"
Composed = Callable[..., DictConfig]
Built = Callable[..., Any]


@functools.cache
def _composed(overrides: tuple[str, ...]) -> DictConfig:
    with initialize_config_dir(str(CONF), version_base="1.3"):
        return compose("config", list(overrides))


@functools.cache
def _built(key: str, overrides: tuple[str, ...]) -> Any:
    cfg = copy.deepcopy(_composed(overrides))  # Hydra resolves for good what it builds from
    return instantiate(OmegaConf.select(cfg, key), _convert_="all")


@pytest.fixture(scope="session")
def composed() -> Composed:
    """composed("dof=3") is the configuration with these overrides."""
    return lambda *overrides: copy.deepcopy(_composed(overrides))  # a test that builds from it resolves its own alone


@pytest.fixture(scope="session")
def built() -> Built:
    """built("arm", "dof=3") is the frozen thing that conf/ makes of one key; built once, because it is frozen."""
    return lambda key, *overrides: _built(key, overrides)


SIX_JOINTS = """<mujoco model="six"><compiler angle="degree" meshdir="parts"/>
  <default><joint range="-170 170" damping="1"/><geom type="mesh" mesh="link" mass="0.5"/>
    <default class="pitch"><joint axis="0 1 0"/></default><default class="roll"><joint axis="1 0 0" range="-90 90"/></default></default>
  <asset><mesh name="link" file="link.obj" scale="0.01 0.01 0.01"/></asset>
  <worldbody><body name="l1" pos="0 0 0.1"><joint name="j1" axis="0 0 1"/><geom/>
    <body name="l2" pos="0 0 0.1"><joint name="j2" class="pitch" range="-100 100"/><geom/>
      <body name="l3" pos="0 0 0.2" euler="0 30 0"><joint name="j3" class="pitch" ref="20"/><geom/>
        <body name="l4" pos="0.15 0 0"><joint name="j4" class="roll"/><geom/>
          <body name="l5" pos="0.05 0 0"><joint name="j5" class="pitch" pos="0 0 0.01"/><geom/>
            <body name="l6" pos="0.05 0 0"><joint name="j6" class="roll"/><geom/><site name="tip" pos="0.1 0 0.02"/>
  </body></body></body></body></body></body></worldbody></mujoco>"""
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"

LINKS = ("base_link", "upper", "fore", "carriage", "tool0")
URDF = (
    '<robot name="four">'
    + "".join(
        f'<link name="{name}"><inertial><mass value="0.4"/>'
        '<inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>'
        f'<visual><geometry><mesh filename="package://four/meshes/{name}.stl"/></geometry></visual></link>'
        for name in LINKS
    )
    + """<joint name="pan" type="revolute"><parent link="base_link"/><child link="upper"/><origin xyz="0 0 0.2" rpy="0 0 0.3"/>
  <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="10" velocity="1"/></joint>
<joint name="tilt" type="continuous"><parent link="upper"/><child link="fore"/>
  <origin xyz="0 0 0.1" rpy="0.2 0 0"/><axis xyz="0 1 0"/></joint>
<joint name="reach" type="prismatic"><parent link="fore"/><child link="carriage"/><origin xyz="0.2 0 0"/><axis xyz="1 0 0"/>
  <limit lower="0" upper="0.3" effort="10" velocity="1"/></joint>
<joint name="flange" type="fixed"><parent link="carriage"/><child link="tool0"/><origin xyz="0.1 0 0" rpy="0 1.5708 0"/></joint></robot>"""
)


@pytest.fixture
def foreign_models(tmp_path: Path) -> Path:
    """A folder with six.xml (six joints in degrees, default classes, a `ref`, meshes in files) and four.urdf (one joint slides)."""
    folder = tmp_path / "models"
    (folder / "parts").mkdir(parents=True)
    (folder / "six.xml").write_text(SIX_JOINTS)
    (folder / "parts" / "link.obj").write_text(TETRAHEDRON)
    (folder / "four.urdf").write_text(URDF)
    return folder


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile before the first test, and in no test's time."""
    if not hasattr(session.config, "workerinput"):  # once, before the workers begin
        first_compile()
