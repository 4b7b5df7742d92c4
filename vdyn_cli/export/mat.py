"""Every parameter as a MATLAB struct; the only module that uses scipy.io."""

from __future__ import annotations

from io import BytesIO

from vdyn_cli.export import ExportedFiles, ExportOptions
from vdyn_cli.export.parameter_file import ParameterFile

HEADER = b"MATLAB 5.0 MAT-file, written by vdyn"  # replaces a header with the time, so that the bytes are reproducible
HEADER_SIZE = 116


def made(parameter_file: ParameterFile, options: ExportOptions) -> ExportedFiles:
    """``<name>.mat`` with a struct of the same name.

    ``vehicle.mass.value``, ``.std``, ``.interval95`` (1 by 2), ``.unit``, ``.meaning`` and ``.source`` in SI units for
    every parameter, and ``vehicle.causes.<effect>.<unknown>`` for the effects that extend the model.
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
        for name, e in parameter_file.parameters.items()
    }
    if parameter_file.effects:
        fields["causes"] = {one.effect: dict(one.unknowns) for one in parameter_file.effects}
    file = BytesIO()
    savemat(
        file,  # type: ignore[arg-type]
        {options.name: fields},
        long_field_names=True,
        oned_as="row",
    )
    data = HEADER.ljust(HEADER_SIZE) + file.getvalue()[HEADER_SIZE:]
    return ExportedFiles({f"{options.name}.mat": data})
