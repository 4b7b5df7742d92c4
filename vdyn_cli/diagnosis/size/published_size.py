"""The published size of a finding: change of the output, shift of the parameters, share of the rms error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_models import best_fit
from vdyn_cli.diagnosis.size.finding_size import FindingSize, explained_share, finding_size, places_of
from vdyn_cli.diagnosis.size.materiality import main_output
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.quantities.arrays import Array, rms
from vdyn_cli.quantities.diagnosis import PointChange, Remainder, Size
from vdyn_cli.quantities.result import Comparison, Result

PLACES = ("start", "largest", "end")  # of a run
WHITENED = "error over its noise"


def published_size(found: FindingSize | None, base: Result, last: Result | None, unit: str) -> Size | None:
    """The size of a finding in output, parameters and rms error; None without a finding.

    Parameters
    ----------
    found : by the diagnosis's fits. base, last : results without and with the effects. Without ``last`` (the model was
        not extended by exactly these effects), the size is that of the fits. unit : of the main channel.
    """
    if found is None:
        return None
    if last is not None and (exact := size_by_results(found, base, last)) is not None:
        output, points = (main_output(base), base.fit.unit), _points(*_largest(_changes(base, last)))
        return _size(output, exact, last.fit.noise_floor, points, base)
    in_unit = found.plain and base.fit.unit == unit
    floor = base.fit.noise_floor if in_unit else 1.0 if not found.plain else float("nan")
    runs = base.fit.runs
    points = tuple(
        PointChange(run=runs[k] if k < len(runs) else str(k + 1), at=PLACES[i], change=change)
        for i, (k, change) in enumerate(found.points)
    )
    output = (main_output(base), unit) if found.plain else (WHITENED, "")
    return _size(output, found, floor, points, base)


def effect_sizes(
    strategy: Strategy, judgment: Judgment, base: Result, last: Result | None, unit: str
) -> dict[str, Size]:
    """The size of each effect of the answer, with its other effects in the model.

    Parameters
    ----------
    base, last : results without and with the answer; ``last`` is None where the model was not extended by it.
    unit : of the main channel.
    """
    answer = judgment.answer
    if answer is None:
        return {}
    if len(answer.effects) == 1:
        size = published_size(judgment.size, base, last, unit)
        return {answer.effects[0]: size} if size else {}
    found = {}
    for effect in answer.effects:
        without = strategy.fitted([e for e in answer.effects if e != effect])
        if without is not None:
            size = published_size(finding_size(strategy, without, answer.fitted), base, None, unit)
            assert size is not None
            found[effect] = size
    return found


def remainder(judgment: Judgment) -> Remainder | None:
    """The significant residual of the answer, of the best of several, or of the model that comes closest."""
    one = best_fit(judgment.answers) or judgment.closest or judgment.immaterial
    if one is None or not np.isfinite(one.residual_share):
        return None
    return Remainder(share_of_rms=one.residual_share, p_value=one.residual_p, mostly=one.residual_like)


def size_by_results(found: FindingSize, base: Result, last: Result) -> FindingSize | None:
    """The size by the step's results, in the unit of the fit; None where no channel is compared in that unit."""
    changes = _changes(base, last)
    if not changes:
        return None
    every = np.concatenate([c[np.isfinite(c)] for _, c in changes])
    moved = {n: e.value - base.parameters[n].value for n, e in last.parameters.items() if n in base.parameters}
    alone = len({c.channel for c in base.comparisons}) == 1
    run, most = _largest(changes)
    runs = base.fit.runs
    number = runs.index(run.run) if run.run in runs else len(runs)  # a comparison may join several runs
    return replace(
        found,
        change=rms(every),
        points=tuple((number, float(most[i])) for i in places_of(most)),
        every=0.0 if alone else found.every,  # of one channel, ``change`` is all
        before=base.fit.rms,
        after=last.fit.rms,
        shifts=moved or found.shifts,
    )


def _largest(changes: list[tuple[Comparison, Array]]) -> tuple[Comparison, Array]:
    return max(changes, key=lambda pair: float(np.nanmax(np.abs(pair[1]))))


def _changes(base: Result, last: Result) -> list[tuple[Comparison, Array]]:
    """The runs with the main output, each with its change, (n,), between the results."""
    channel, after = main_output(base), {(c.run, c.channel): c for c in last.comparisons}
    found = []
    for one in base.comparisons:
        other = after.get((one.run, one.channel))
        if one.channel.replace(" ", "_") != channel or other is None or other.simulated.shape != one.simulated.shape:
            continue
        change = other.simulated - one.simulated
        if np.isfinite(change).any():
            found.append((one, change))
    return found


def _size(
    output: tuple[str, str], found: FindingSize, floor: float, points: tuple[PointChange, ...], base: Result
) -> Size:
    """The size of a finding in the ``output``, its name and unit, with its noise ``floor``."""
    std = {n: base.parameters[n].std if n in base.parameters else found.stds.get(n, 0.0) for n in found.shifts}
    return Size(
        output=output[0],
        unit=output[1],
        change=found.change,
        noise_floor=floor,
        points=points,
        shifts_in_std={n: moved / std[n] for n, moved in found.shifts.items() if std[n] > 0},
        share_of_rms=explained_share(found.before, found.after, floor),
    )


def _points(run: Comparison, change: Array) -> tuple[PointChange, ...]:
    places = places_of(change)
    return tuple(PointChange(run=run.run, at=f"{run.x_label} {run.x[i]:.3g}", change=float(change[i])) for i in places)
