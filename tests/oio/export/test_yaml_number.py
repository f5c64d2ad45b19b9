"""Every float comes back from YAML as the float that it was."""

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from oio.export.yaml_number import yaml_number


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_comes_back(value):
    back = yaml.safe_load(yaml_number(value))
    assert isinstance(back, float) and back == value


@pytest.mark.parametrize(("value", "text"), [(1e-9, "1.0e-09"), (0.0, "0.0"), (-0.0, "0.0"), (1e22, "1.0e+22"), (2, "2.0")])
def test_as_it_is_written(value, text):
    assert yaml_number(value) == text
