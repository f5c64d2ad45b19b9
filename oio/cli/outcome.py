"""What went wrong below Hydra, which would print an exception twice: noted here, raised when Hydra is done."""

FAILED: list[Exception] = []


def raise_first() -> None:
    """Raise the first error noted, if there is one, and forget them all."""
    noted = list(FAILED)
    FAILED.clear()
    if noted:
        raise noted[0]
