"""How often a diagnosis may raise a false alarm."""

LEVEL = 0.05  # of one step's diagnosis; of all of a pipeline's together


def shared(steps: int) -> float:
    """The level of each of several steps, so that they keep it together (Bonferroni), as ``--level`` can state it."""
    return float(f"{LEVEL / max(steps, 1):.4g}")
