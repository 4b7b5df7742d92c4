"""Every parameter as a MATLAB struct. The one door to scipy.io."""

from __future__ import annotations

from io import BytesIO

from vdyn_cli.export import Made, Options
from vdyn_cli.export.given import Given

HEADER = b"MATLAB 5.0 MAT-file, written by vdyn"  # in place of a text with the time of day
HEADER_SIZE = 116


def made(given: Given, options: Options) -> Made:
    """``<name>.mat`` with a struct of the same name.

    ``vehicle.mass.value``, ``.std``, ``.interval95`` (1 by 2), ``.unit``, ``.meaning`` and ``.source`` in SI units for
    every parameter, and ``vehicle.causes.<effect>.<unknown>`` for those by which the model was extended.
    """
    import numpy as np
    from scipy.io import savemat

    fields: dict[str, object] = {
        name: {
            "value": e.value,
            "std": e.std,
            "interval95": np.array([e.interval95]),
            "unit": e.unit,
            "meaning": e.meaning,
            "source": e.source,
        }
        for name, e in given.parameters.items()
    }
    if given.causes:
        fields["causes"] = {cause.effect: dict(cause.unknowns) for cause in given.causes}
    file = BytesIO()
    savemat(
        file,  # type: ignore[arg-type]
        {options.name: fields},
        long_field_names=True,
        oned_as="row",
    )
    data = HEADER.ljust(HEADER_SIZE) + file.getvalue()[HEADER_SIZE:]
    return Made({f"{options.name}.mat": data})
