"""Contract of the two ways to fit candidate models: simulate at every step of a fit, or fit a linearization."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf
from typing import TYPE_CHECKING, Protocol

from vdyn_cli.diagnosis.strategies.full_model import FittedModel, FullModel
from vdyn_cli.steps.contract import NO_VALUES

if TYPE_CHECKING:
    from vdyn_cli.diagnosis.detect.detection import Detection


class Strategy(Protocol):
    """The fits that a diagnosis needs; each is computed once.

    Parameters
    ----------
    model : the full model whose nested models are fitted.
    """

    model: FullModel

    @property
    def base(self) -> FittedModel:
        """The fit of the baseline, without effects; raises as ``fitted`` does."""
        base = self.fitted(())
        assert base is not None
        return base

    @property
    def nonlinear(self) -> bool:
        """Whether the sensitivities of a fit with effects differ from those of the baseline's fit."""

    @property
    def prior_values(self) -> Mapping[str, float]:
        """Values at which predictions hold the parameters, whatever a fit gives; empty (default): fitted ones."""
        return NO_VALUES

    def fitted(self, effects: Sequence[str], below: float = inf) -> FittedModel | None:
        """The fit with these effects; None where it fails. If the fit of the baseline fails, it raises instead.

        A fit that does not predict a cost ``below`` the one given may end early, as None.
        """

    def relinearized(self, fitted: FittedModel) -> FittedModel:
        """The same fit linearized about its own amplitudes, with no other effects in the model.

        By default the fit itself, if it is linearized there already.
        """
        return fitted

    def predicted(self, fitted: FittedModel, effects: Sequence[str], values: Mapping[str, float]) -> FittedModel | None:
        """The runs simulated at the prior values with these effects, weighted by the noise of ``fitted``.

        None where predictions use the fit itself (default), or where the model has no finite value.
        """
        return None

    def with_open_range(self, about: str = "") -> Strategy:
        """The strategy whose effects may exceed their plausible range up to ``open_range``.

        Parameters
        ----------
        about : an effect; where the baseline is far off, the strategy is linearized about that effect's fit.
        """

    def secants(self, effects: Sequence[str]) -> Mapping[str, float]:
        """Amplitudes over which secants replace the slopes of nondifferentiable effects, with ``effects`` fitted.

        None by default: these effects are then linearized about their likely amplitude.
        """
        return NO_VALUES

    def about(self, fitted: FittedModel) -> Strategy:
        """The strategy linearized about a fit with effects; by default unchanged, as where its fits simulate."""
        return self

    def about_largest_effect(self, found: Detection) -> tuple[Strategy, Detection]:
        """The strategy linearized about the largest effect, with the detection repeated; unchanged by default."""
        return self, found
