"""What is diagnosed: a step's regression with every cause that its model can take, free profiles among them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from vdyn_cli.diagnosis.level import LEVEL
from vdyn_cli.effects import Effect
from vdyn_cli.inference import Regression, Unknown
from vdyn_cli.steps.manoeuvre import Manoeuvre

REACH = 1.5  # times the plausible range: a cause that needs more is not the cause


@dataclass(frozen=True)
class Case:
    """One step's data and model, open to causes.

    Parameters
    ----------
    regression : the step's own, with effects in the model and their unknowns beside the step's; where straight lines
        have to do also begun at some values of its own unknowns.
    effects : the named causes that model and data can take.
    profiles : free profiles, each of one family (speed, time, position ...).
    one_way : why what turns with the direction can't be told from what does not, as when all runs went the same way.
    repeated : what a run is called (a coast, a drive, a crossing).
    fewest_runs : below which nothing is diagnosed.
    too_short : why causes look alike in runs so short.
    level : chance of a false alarm.
    straight : one simulation has to do; fits are made on straight lines. The parameters are beliefs with which the step
        simulates: what fits move of them is no gain.
    bent : what has no slope at nothing is in the model from the start: straight lines are laid until they hold.
    likely : (effect, begun) -> the size of an effect without a slope at nothing about which straight lines are laid,
        and by how much the log likelihood rises with it; ``begun(size)`` are its unknowns. None where such effects are
        not looked for on straight lines.
    manoeuvres : (regression with every cause in, its shared unknowns at the baseline's fit) -> what could be driven
        next, the least effort first.
    """

    step: str
    regression: Callable[..., Regression]
    effects: tuple[Effect, ...]
    profiles: tuple[Effect, ...]
    one_way: str = ""
    repeated: str = "run"
    fewest_runs: int = 1
    too_short: str = ""
    level: float = LEVEL
    straight: bool = False
    bent: bool = False
    likely: Callable[[Effect, Callable[[float], tuple[Unknown, ...]]], tuple[float, float] | None] | None = None
    manoeuvres: Callable[[Regression, Mapping[str, float]], tuple[Manoeuvre, ...]] = lambda regression, values: ()

    @property
    def causes(self) -> Mapping[str, Effect]:
        return {e.name: e for e in self.effects}

    @property
    def families(self) -> Mapping[str, Effect]:
        return {e.name: e for e in self.profiles}


def scanned(effect: Effect) -> tuple[str, ...]:
    """The unknowns of an effect that the scan frees: all but those that only shape it."""
    return tuple(n for n in effect.unknowns if n not in effect.nominal)


def shapes_of(effect: Effect) -> tuple[str, ...]:
    """The unknowns that only shape an effect (a decay time): free in a fit that has the effect in, else at nominal."""
    return tuple(effect.nominal)


def unknowns_of(effect: Effect, prior: bool = False) -> tuple[Unknown, ...]:
    """An effect's unknowns for a fit, within their range and somewhat beyond.

    What shapes the effect stays within its range and is believed near nominal, to a quarter of that range: without a
    size a shape shows in no data.

    Parameters
    ----------
    prior : keep them about nothing within their plausible range, so that a whole catalogue can be fitted at once.
    """
    found = []
    for name, quantity in effect.unknowns.items():
        if name in effect.nominal:
            nominal = effect.nominal[name]
            believed = nominal, (quantity.upper - quantity.lower) / 4
            found.append(Unknown(name, nominal, quantity.lower, quantity.upper, quantity.unit, believed))
            continue
        reach = max(abs(quantity.lower), abs(quantity.upper))
        low, high = REACH * quantity.lower, REACH * quantity.upper
        known = (0.0, reach / 2) if prior else None
        found.append(Unknown(name, 0.0, low, high, quantity.unit, known))
    return tuple(found)


def begun_at(unknown: Unknown, values: Mapping[str, float]) -> Unknown:
    """The unknown begun where it was found, within its range."""
    start = values.get(unknown.name, unknown.start)
    return replace(unknown, start=min(max(start, unknown.lower), unknown.upper))
