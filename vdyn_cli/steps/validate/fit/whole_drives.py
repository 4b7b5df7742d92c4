"""The regression of drives cut into segments by stops and brakes: all segments of a drive share its wind.

Wind, slope and force that last for a whole drive are unknowns of the drive, with priors from the noise model. If the
segments were whitened one by one, each would have an independent wind, and a headwind would seem to be known better by
the root of the number of segments in a drive. Sensor zeros are unknowns of the drive, too. The start speed of each
segment is projected out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.inference import Regression, Rows, Unknown
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.validate.car.simulation import SimulationSetup
from vdyn_cli.steps.validate.car.unknowns import START
from vdyn_cli.steps.validate.fit.drive_regression import drives_of, joined, without_start
from vdyn_cli.steps.validate.fit.whitening import WhitenedDrives, whiten_drives


@dataclass(frozen=True, eq=False)
class _WholeDriveRows:
    whitened: WhitenedDrives
    drives: tuple[tuple[int, ...], ...]

    def __call__(self, run: int, theta: Array) -> Rows:
        return joined([self._segment(k, theta) for k in self.drives[run]])

    def _segment(self, segment: int, theta: Array) -> Rows:
        """The rows of a segment at a drive's unknowns: shared ones, zeros, and steady sources."""
        w = self.whitened
        vector, one = w.setup.vector, w.whitenings[segment]
        shared, end = len(vector.shared), len(vector.shared) + len(vector.own)
        start = vector.start(segment)[shared : shared + 1]
        rows = w(segment, np.concatenate([theta[:shared], start, theta[shared : end - 1]]))
        assert rows.plain is not None
        white = np.zeros((rows.residual.size, one.steady.shape[1]))
        white[: len(one.steady)] = one.white_steady
        lasting, count = theta[end - 1 :], rows.plain[0].size
        speeds = one.steady[:count]
        rows = replace(
            rows,
            residual=rows.residual + white @ lasting,
            jacobian=np.hstack([rows.jacobian, white]),
            plain=(rows.plain[0] + speeds @ lasting, np.hstack([rows.plain[1], speeds])),
        )
        others = [*range(shared), *range(shared + 1, rows.jacobian.shape[1])]
        return replace(without_start(rows, shared, others), plain_root=rows.plain_root)


def is_cut(setup: SimulationSetup) -> bool:
    """Whether several drives of a mass on a road are simulated in more segments than drives.

    The segments of a single drive remain the units, since one run does not separate an effect from noise.
    """
    return setup.model.name != "vehicle" and 1 < len({s.run for s in setup.segments}) < len(setup.segments)


def whole_drives(setup: SimulationSetup) -> Regression:
    """The regression of drives that were cut into segments; its runs are the drives.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    w = whiten_drives(setup, averaged=True, steady_apart=True)
    names, drives = drives_of(w.setup)
    lasting = tuple(
        Unknown(n, 0.0, -50.0, 50.0, "", (0.0, 1.0), per_run=True, nuisance=True, prior_stated=False)
        for n in w.whitenings[0].steady_sources
    )
    unknowns = tuple(u for u in w.regression.unknowns if u.name != START)
    shown = [np.vstack([w.whitenings[k].white_steady for k in d]) for d in drives]
    log_noise = w.regression.log_noise + sum(
        0.5 * float(np.linalg.slogdet(np.eye(s.shape[1]) + s.T @ s)[1]) for s in shown
    )
    return Regression((*unknowns, *lasting), names, _WholeDriveRows(w, drives), log_noise=log_noise)
