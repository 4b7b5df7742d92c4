"""All findings of a validation, from which tables, figures and sentences are made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vdyn_cli.quantities.arrays import Array, rms
from vdyn_cli.steps.validate.car.prior import INSENSITIVE, ParameterPrior
from vdyn_cli.steps.validate.drives.segments import DriveSegment
from vdyn_cli.steps.validate.fit.posterior import Posterior
from vdyn_cli.steps.validate.fit.whitening import WhitenedDrives
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY
from vdyn_cli.steps.validate.prediction_band import BandTest, PredictionBand
from vdyn_cli.steps.validate.road.open_road import RoadFindings


@dataclass(frozen=True, eq=False)
class Validation:
    """The findings.

    Parameters
    ----------
    whitened : the drives simulated at the prior, with accepted effects.
    shown : the drives in tables and figures: on open roads at the fitted parameters, else the same.
    bands : for each segment, the band of every output. tests : by output, the test of the time outside its band.
    chance : p value of the worst output, adjusted for their number. posterior : of the parameters.
    road : findings of an extended model about open roads, else None.
    missed : rms error of the speed over the whole drives that the windows replace, m/s; 0 if they replace none.
    """

    whitened: WhitenedDrives
    shown: WhitenedDrives
    bands: tuple[dict[str, PredictionBand], ...]
    tests: Mapping[str, BandTest]
    chance: float
    posterior: Posterior
    road: RoadFindings | None
    missed: float = 0.0

    @property
    def prior(self) -> ParameterPrior:
        """The prior of the parameters."""
        return self.whitened.setup.prior

    @property
    def segments(self) -> tuple[DriveSegment, ...]:
        """The simulated segments."""
        return self.whitened.setup.segments

    @property
    def outputs(self) -> list[str]:
        """Names of the compared outputs."""
        return list(dict.fromkeys(n for one in self.bands for n in one))

    def bands_of(self, name: str) -> list[PredictionBand]:
        """An output's bands in the segments that have it."""
        return [one[name] for one in self.bands if name in one]

    def errors(self, name: str) -> Array:
        """Finite errors (n,) of an output over all segments, simulated minus measured."""
        error = np.concatenate([one.error for one in self.bands_of(name)])
        return np.asarray(error[np.isfinite(error)])

    def parameter_std(self, name: str) -> float:
        """Rms standard deviation of an output by the parameters' uncertainty."""
        return rms(*(one.own for one in self.bands_of(name)))

    @cached_property
    def shares(self) -> dict[str, dict[str, float]]:
        """By output and parameter, the share of the variance of the parameters' band, largest first."""
        names, found = self.prior.names, {}
        for name in self.outputs:
            parts = np.sum([one.shares for one in self.bands_of(name)], axis=0)
            total = float(parts.sum())
            found[name] = {names[i]: float(parts[i] / total) for i in np.argsort(-parts)} if total > 0 else {}
        return found

    @property
    def outside(self) -> list[str]:
        """Outputs that are significantly long outside their band; none where all together are within chance."""
        if self.chance >= VALIDATE_POLICY.band_chance:
            return []
        found = [n for n, v in self.tests.items() if v.chance <= VALIDATE_POLICY.output_chance]
        return found or [min(self.tests, key=lambda n: self.tests[n].chance)]

    @property
    def contradicted(self) -> list[str]:
        """Parameters that the drives contradict, the worst first, except those without effect on a straight drive."""
        names, pull = self.prior.names, np.abs(np.nan_to_num(self.posterior.pull))
        return [
            names[i] for i in np.argsort(-pull) if pull[i] > VALIDATE_POLICY.large_pull and names[i] not in INSENSITIVE
        ]
