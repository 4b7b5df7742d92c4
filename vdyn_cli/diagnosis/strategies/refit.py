"""The strategy for models that are cheap to simulate: every step of a fit simulates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.effect_unknowns import amplitudes_of, delay_starts, shapes_of, started_at
from vdyn_cli.diagnosis.strategies.full_model import with_open_range
from vdyn_cli.diagnosis.strategies.nested_fits import NestedFits
from vdyn_cli.inference import Regression


@dataclass(frozen=True)
class RefitStrategy(NestedFits):
    """Nonlinear fits, from several starts for effects whose slope at zero amplitude is zero or misleading."""

    @property
    def nonlinear(self) -> bool:
        """True: every fit simulates at its own values."""
        return True

    def with_open_range(self, about: str = "") -> RefitStrategy:
        """See Strategy."""
        return RefitStrategy(with_open_range(self.model), {(): self.base})

    def secants(self, effects: Sequence[str]) -> Mapping[str, float]:
        """The middle probe of each nondifferentiable effect that is not in the model."""
        return {
            amplitudes_of(e)[0]: e.probes[len(e.probes) // 2]
            for e in self.model.setup.effects
            if e.probes and e.name not in effects
        }

    def _starts(self, regression: Regression, effects: Sequence[str], shapes: bool) -> Iterator[Regression]:
        candidates = [self.model.setup.candidates[e] for e in effects if e in self.model.setup.candidates]
        for effect in candidates if not shapes else ():
            first = amplitudes_of(effect)[0]
            for delay in delay_starts(effect):
                yield regression.changed(partial(started_at, values={first: delay}))
            for probe in spread_over(effect.probes, POLICY.most_probes):
                # Bounded from below: a fit that returns to zero converges slowly, and the start at zero covers that.
                floor = POLICY.probe_floor * min(effect.probes)
                yield regression.changed(partial(replace, start=probe, lower=floor), {first})
        for effect in candidates if shapes else ():
            # At zero amplitude the data do not determine a shape; with a wrong shape, the amplitude may have the wrong
            # sign.
            first = amplitudes_of(effect)[0]
            range_ = effect.unknowns[first]
            some = POLICY.shape_start * (range_.upper if range_.upper > 0 else range_.lower)
            for shape in shapes_of(effect):
                quantity, nominal = effect.unknowns[shape], effect.nominal[shape]
                for end in (quantity.lower, quantity.upper):
                    start = {shape: (nominal + end) / 2, first: some}
                    yield regression.changed(partial(started_at, values=start))


def spread_over(probes: Sequence[float], most: int) -> list[float]:
    """At most ``most`` of the probes, evenly over their list, including the first and the last."""
    last = len(probes) - 1
    count = min(most, len(probes))
    return [probes[round(i * last / max(count - 1, 1))] for i in range(count)]
