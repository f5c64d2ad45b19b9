"""Numbers in YAML files that are written as text, for their comments."""


def yaml_number(value: float) -> str:
    """Return a finite float, every digit of it, as both YAML 1.1 and 1.2 read it: to the former, `1e-05` without a point is text."""
    mantissa, e, exponent = repr(float(value) + 0.0).partition("e")
    return f"{mantissa}{'' if '.' in mantissa else '.0'}{e}{exponent}"
