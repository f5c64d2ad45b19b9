"""Old configuration keys are refused with the new name, and translated where they stand in an old log."""

import pytest
from hydra.core.global_hydra import GlobalHydra
from omegaconf import OmegaConf

from oio.cli.hydra_errors import known_error
from oio.cli.renamed_keys import RENAMED, modernised, renamed
from oio.core.errors import BadInput
from oio.core.folders import CONF

CHOICES = {
    "search": [(f"search={name}",) for name in ("d_optimal", "infotaxis", "gradient", "cast_surge", "bandit")],
    "ekf": [(f"ekf={name}",) for name in ("fixed_lag", "gaussian_sum")],
    "backend": [("backend=serial", "backend.nose.driver=scd30", "backend.nose.port=ask")],
}


@pytest.mark.parametrize(("old", "new"), RENAMED.items())
def test_the_new_key_is_there_and_the_old_one_is_nowhere(composed, old, new):
    missing, configurations = object(), [composed(*words) for words in CHOICES.get(old.split(".")[0], [()])]
    assert any(OmegaConf.select(cfg, new, default=missing) is not missing for cfg in configurations)
    assert all(OmegaConf.select(cfg, old, default=missing) is missing for cfg in configurations)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("range.stray", "range_law.model_discrepancy"),
        ("range.exponent", "range_law.exponent"),
        ("wander.wind_per_m_sqrt_s", "process_noise.wind_per_m_sqrt_s"),
        ("stage.navigate.lost", "stage.navigate.mapping.lost_moves"),
        ("room.period_s", "climate.period_s"),
    ],
)
def test_an_old_key_is_refused_with_the_new_name(composed, old, new):
    assert renamed(old) == new and modernised(f"{old}=3") == f"{new}=3"
    GlobalHydra.instance().clear()
    with pytest.raises(Exception, match=r"not in struct|Could not override") as refused:
        composed(f"{old}=3")
    error = known_error(refused.value, CONF)
    assert isinstance(error, BadInput) and str(error) == f"'{old}' is now called '{new}'. Type {new}=VALUE."


@pytest.mark.parametrize("key", ["sensor", "range_law.exponent", "stop.sd_m", "ranges.stray", "rooms"])
def test_other_keys_keep_their_names(key):
    assert renamed(key) is None and modernised(f"{key}=a=b") == f"{key}=a=b"
