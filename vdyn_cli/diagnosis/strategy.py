"""How candidate models are fitted: by simulating at every step, or on a linearization."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from vdyn_cli.diagnosis.full_model import FittedModel, FullModel

if TYPE_CHECKING:
    from vdyn_cli.diagnosis.detection import Detection


class Strategy(Protocol):
    """The fits that a diagnosis asks for, each made once."""

    @property
    def model(self) -> FullModel:
        """The full model whose nested models are fitted."""

    @property
    def prior_values(self) -> Mapping[str, float]:
        """Parameters at which predictions simulate whatever a fit makes of them; none where fits count."""

    def fitted(self, effects: Sequence[str] = ()) -> FittedModel | None:
        """The fit with these effects in; None where it fails. That of the baseline raises instead."""

    def relinearized(self, fitted: FittedModel) -> FittedModel:
        """The same fit, linearized about its own amplitudes, with its own effects alone in the model."""

    def rescanned(self, effects: Sequence[str]) -> FittedModel | None:
        """The fit with these effects in, where sensitivities differ from those of the baseline's fit; else None."""

    def predicted(self, fitted: FittedModel, effects: Sequence[str], values: Mapping[str, float]) -> FittedModel | None:
        """The runs simulated at the prior values with these effects, weighted by the noise of ``fitted``.

        None where predictions are those of the fit, or the model has no finite value there.
        """

    def beyond_range(self) -> Strategy:
        """The strategy whose effects may exceed their plausible range up to ``open_range``."""

    def secants(self, effects: Sequence[str]) -> Mapping[str, float]:
        """Amplitudes over which sensitivities of nondifferentiable effects are taken, with ``effects`` in."""

    def focused(self, found: Detection) -> tuple[Strategy, Detection]:
        """Fits in which large effects are not distorted, and what is detected in them."""
