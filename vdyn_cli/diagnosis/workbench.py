"""The fits and linearisations that a diagnosis asks for, each made once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from vdyn_cli.diagnosis.case import Case, begun_at, scanned, shapes_of, unknowns_of
from vdyn_cli.diagnosis.scores import Scores, scores
from vdyn_cli.diagnosis.sheet import Linear, Sheet, as_measured, linearise, sheet
from vdyn_cli.inference import Regression, Solution, Unknown, solve
from vdyn_cli.inference.linearized_regression import linearized
from vdyn_cli.inference.restrict import restricted, without_priors
from vdyn_cli.quantities.errors import ResultError

NOTHING: Mapping[str, float] = MappingProxyType({})
LINES = 3  # through a cause's size, each time through the one that the last found
CLEARLY = 4.5  # half the square of three standard errors
CLOSE = 0.5  # standard deviations that the next would hardly move it
MOST_PROBES = 5  # tried of an effect's
SOME = 0.1  # of the plausible range
HARDLY = 0.1  # of the least probe
LEAST_STEP = 1e-2  # of one residual's variance that a further step may still promise


@dataclass(frozen=True)
class Fitted:
    """The baseline with some causes in, fitted, and the full set of traces there.

    Parameters
    ----------
    causes : accepted here.
    values : of every shared unknown.
    """

    causes: tuple[str, ...]
    solution: Solution
    linear: Linear
    sheet: Sheet

    @property
    def values(self) -> Mapping[str, float]:
        return self.solution.values


@dataclass
class Workbench:
    """A case's full regression, its noise taken from the residual that no cause is left in.

    Parameters
    ----------
    full : baseline, all causes and all profiles; priors on causes left out again.
    base : names of the baseline's shared unknowns.
    """

    case: Case
    full: Regression
    base: tuple[str, ...]
    _fits: dict[tuple[str, ...], Fitted | None] = field(default_factory=dict)
    _near: dict[tuple[str, ...], Fitted] = field(default_factory=dict)
    _tried: dict[str, tuple[float, float] | None] = field(default_factory=dict)
    _last: dict[tuple[tuple[str, ...], tuple[tuple[str, float], ...]], Regression] = field(default_factory=dict)

    def unknowns(self, cause: str) -> tuple[str, ...]:
        """What the scan frees of a cause or a profile."""
        effect = self.case.causes.get(cause) or self.case.families[cause]
        return scanned(effect)

    def freed(self, cause: str) -> tuple[str, ...]:
        """What a fit frees of a cause or a profile that it has in."""
        effect = self.case.causes.get(cause) or self.case.families[cause]
        return (*scanned(effect), *shapes_of(effect))

    @property
    def nuisances(self) -> frozenset[str]:
        """Shared unknowns of the baseline that nobody asks for."""
        return frozenset(u.name for u in self.full.shared if u.nuisance)

    def held(self, causes: Sequence[str]) -> dict[str, float]:
        covered = {n for c in causes if c in self.case.causes for n in self.case.causes[c].covers}
        free = {n for c in causes for n in self.freed(c)} | set(self.base) - covered
        return {u.name: u.start for u in self.full.shared if u.name not in free}

    def fitted(self, causes: Sequence[str] = ()) -> Fitted | None:
        """The fit with these causes in; None where the data do not allow it, or it needs more than is plausible."""
        key = tuple(sorted(causes))
        if key not in self._fits:
            self._fits[key] = self._fit(key)
        return self._fits[key]

    def _fit(self, causes: tuple[str, ...]) -> Fitted | None:
        try:
            solution = self._solved(causes)
            linear = linearise(self.full, solution.values, solution.per_run, self.secants(causes))
        except (ResultError, ArithmeticError):
            if not causes:
                raise
            return None
        return Fitted(causes, solution, linear, sheet(linear))

    def _solved(self, causes: tuple[str, ...]) -> Solution:
        """The best of the fits from every start; with shapes at nominal where the data do not determine them.

        It goes on from the best fit so far of some of these causes, and tries the other starts of the others.
        """
        known = [f for k, f in self._fits.items() if f is not None and set(k) < set(causes)]
        before = min(known, key=lambda f: f.solution.cost, default=None)
        others = [c for c in causes if before is None or c not in before.causes]
        shapes = {n for c in causes for n in self.freed(c)} - {n for c in causes for n in self.unknowns(c)}
        held = self.held(causes)
        nominal = held | {u.name: u.start for u in self.full.shared if u.name in shapes}
        failed: list[ResultError] = []
        for at in (held, nominal) if shapes else (held,):
            regression = restricted(self.full, at, before.solution if before else None)
            if not causes:
                regression = replace(regression, unknowns=tuple(map(_unended, regression.unknowns)))
            found = []
            shaped = self._shaped(regression, others) if at is held else ()
            for start in (regression, *self._probed(regression, others), *shaped):
                try:
                    found.append(solve(start, tolerance=LEAST_STEP))
                except ResultError as error:
                    failed.append(error)
            if found:
                return min(found, key=lambda s: s.cost)
        raise failed[-1]

    def about(self, cause: str | None) -> Workbench:
        """Where straight lines have to do, those through the car as it drove: with a cause that explains most in it.

        Causes that are alike make it drive alike, so that none of them is favoured. Lines through a car with nothing
        wrong bend too much for causes that are large.
        """
        nearer, before = self, None
        lines = self.case.straight and cause is not None and not self._knock((cause,))
        for _ in range(LINES if lines else 0):
            fitted = nearer.fitted((cause,)) if cause else None
            if fitted is None or cause is None:
                break
            if nearer is self:
                fitted = self.near(fitted)
            sizes = {n: fitted.values[n] for n in self.unknowns(cause)}
            own = {n: fitted.values[n] for n in self.base}
            if before and all(abs(v - before[n]) < CLOSE * fitted.solution.std[n] for n, v in sizes.items()):
                break
            try:
                again, before = open_workbench(self.case, own | sizes), sizes
                again.fitted(())
            except (ResultError, ArithmeticError):
                break
            nearer = again
        return nearer

    def beyond(self, cause: str, other: Workbench) -> Workbench:
        """The lines through a cause that has no slope at nothing: ``cause`` itself, or one that explains clearly more.

        Only of causes that look like ``cause``, which explains most on the lines of ``other``; else those.
        """
        alike = [e.name for e in self.case.effects if self._knock((e.name,)) and cause in (e.name, *e.alike)]
        explained = {name: tried[1] for name in alike if (tried := self._likely(name)) is not None}
        best = max(explained, key=explained.__getitem__, default=cause)
        base, fitted = self.fitted(()), other.fitted((cause,))
        if best != cause and base is not None and fitted is not None:
            least = min(fitted.solution.cost, other.near(fitted).solution.cost)
            if explained[best] < base.solution.cost - least + CLEARLY:
                return other
        found = self._through_likely(best) if explained else None
        if found is None:
            return other
        try:
            bench = open_workbench(self.case, {n: found.values[n] for n in (*self.base, *self.unknowns(best))})
            bench.fitted(())
        except (ResultError, ArithmeticError):
            return other
        bench._near[(best,)] = found
        return bench

    def _knock(self, causes: Sequence[str]) -> bool:
        """Are any of them looked for by sizes that are tried, where straight lines have to do?"""
        known = self.case.causes
        return self.case.likely is not None and any(known[c].probes for c in causes if c in known)

    def _likely(self, cause: str) -> tuple[float, float] | None:
        """The size of a cause that the step finds likely, and by how much it explains the runs better than nothing.

        None where no size can be simulated.
        """
        effect = self.case.causes[cause]
        if cause not in self._tried and self.case.likely is not None:

            def begun(size: float) -> tuple[Unknown, ...]:
                return tuple(begun_at(u, {scanned(effect)[0]: size}) for u in unknowns_of(effect))

            try:
                self._tried[cause] = self.case.likely(effect, begun)
            except (ResultError, ArithmeticError):
                self._tried[cause] = None
        return self._tried.get(cause)

    def _through_likely(self, cause: str) -> Fitted | None:
        """The fit on lines through the size that is likely, alone in the model; None: it fails."""
        likely = self._likely(cause)
        if likely is None:
            return None
        if (cause,) not in self._near:
            try:
                self._near[(cause,)] = self._knocking((cause,), {self.unknowns(cause)[0]: likely[0]})
            except (ResultError, ArithmeticError):
                return None
        return self._near[(cause,)]

    def _knocking(self, causes: tuple[str, ...], through: Mapping[str, float]) -> Fitted:
        """The fit on lines that are laid once more through what they gave: where flanks knock, lines bend."""
        return self._lines(causes, self._lines(causes, through).values)

    def near(self, fitted: Fitted) -> Fitted:
        """The same fit on straight lines through itself, with its own causes alone in the model.

        Of a cause that has no slope at nothing, through the size that is likely: a fit on other lines tells none.

        Where straight lines have to do, those through a car with nothing wrong are too far off for the size of a cause
        that is large. Fits that simulate at every step are near already.
        """
        if not self.case.straight or not fitted.causes:
            return fitted
        if fitted.causes not in self._near:
            if self._knock(fitted.causes) and len(fitted.causes) == 1:
                return self._through_likely(fitted.causes[0]) or fitted
            laid = self._knocking if self._knock(fitted.causes) else self._lines
            try:
                self._near[fitted.causes] = laid(fitted.causes, fitted.values)
            except (ResultError, ArithmeticError):
                self._near[fitted.causes] = fitted
        return self._near[fitted.causes]

    def _lines(self, causes: tuple[str, ...], through: Mapping[str, float]) -> Fitted:
        lines = linearized(self._alone(causes, through))
        solution = solve(lines, tolerance=LEAST_STEP)
        linear = linearise(lines, solution.values, solution.per_run)
        return Fitted(causes, solution, linear, sheet(linear))

    def _alone(self, causes: tuple[str, ...], through: Mapping[str, float]) -> Regression:
        """The step's regression with these causes alone in the model, begun at these sizes; the last one is kept."""
        key = causes, tuple(through.items())
        if key not in self._last:
            effects = [self.case.causes[c] for c in causes]
            extra = [begun_at(u, through) for e in effects for u in unknowns_of(e)]
            begun = {n: v for n, v in through.items() if n in self.base}
            self._last = {key: self.case.regression(effects, extra, start=begun)}
        return self._last[key]

    def simulated(
        self, fitted: Fitted, causes: Sequence[str] = (), sizes: Mapping[str, float] = NOTHING
    ) -> Fitted | None:
        """The runs with parameters as believed and causes of these sizes, weighed by the noise with ``fitted`` in.

        Sums of squares can be compared only where they are weighed alike; what a cause leaves out passes for noise.
        None where the model has no finite value there, or where fits simulate at every step: those are near already.
        """
        if not self.case.straight or not fitted.causes:
            return None
        every = tuple(sorted({*fitted.causes, *causes}))
        nothing = {n: 0.0 for c in every for n in self.unknowns(c)}
        try:
            alone = self._alone(every, fitted.values)
            linear = linearise(alone, {**nothing, **sizes, **self.believed}, as_measured(alone))
        except (ResultError, ArithmeticError):
            return None
        return Fitted(tuple(causes), fitted.solution, linear, sheet(linear))

    @property
    def believed(self) -> Mapping[str, float]:
        """Parameters that the step simulates with, whatever a fit makes of them."""
        base = set(self.base) if self.case.straight else set()
        return {u.name: u.prior[0] for u in self.full.shared if u.prior and u.name in base}

    def _probed(self, regression: Regression, causes: Sequence[str]) -> Iterator[Regression]:
        """The same fit begun at each probe of a cause whose derivative at zero leads nowhere.

        It stays above a part of the least: below, a fit that goes back to nothing creeps, and those from nothing find
        what there is.
        """
        for name in causes:
            effect = self.case.causes.get(name)
            probes = _some(effect.probes) if effect else ()
            for size in () if self.case.straight else probes:
                least = HARDLY * min(probes)
                begun = tuple(
                    replace(u, start=size, lower=least) if u.name == self.unknowns(name)[0] else u
                    for u in regression.unknowns
                )
                yield replace(regression, unknowns=begun)

    def _shaped(self, regression: Regression, causes: Sequence[str]) -> Iterator[Regression]:
        """The same fit begun with a cause of some size and another shape, half way to each end of its range.

        At no size a shape shows in no data, and with the wrong shape a size may seem to have the wrong sign.
        """
        shaped = [self.case.causes[n] for n in causes if n in self.case.causes]
        for effect in () if self.case.straight else shaped:
            for shape in shapes_of(effect):
                quantity, nominal = effect.unknowns[shape], effect.nominal[shape]
                first = scanned(effect)[0]
                size = effect.unknowns[first]
                some = SOME * (size.upper if size.upper > 0 else size.lower)
                for end in (quantity.lower, quantity.upper):
                    begun = {shape: (nominal + end) / 2, first: some}
                    yield replace(regression, unknowns=tuple(begun_at(u, begun) for u in regression.unknowns))

    def secants(self, causes: Sequence[str]) -> dict[str, float]:
        """Sizes over which the traces of such causes are taken where they have no slope at zero."""
        if self.case.straight:
            return {}
        return {
            self.unknowns(e.name)[0]: e.probes[len(e.probes) // 2]
            for e in self.case.effects
            if e.probes and e.name not in causes
        }

    def scores(self, at: Fitted, names: Sequence[str], runs: bool = False) -> Scores:
        """Scores of causes and profiles beside the baseline and the causes that are in."""
        fitted = [*self.base, *(n for c in at.causes for n in self.freed(c))]
        candidates = {n: self.unknowns(n) for n in names if n not in at.causes}
        return scores(at.sheet.by_run() if runs else at.sheet, fitted, candidates)


def _some(probes: tuple[float, ...]) -> tuple[float, ...]:
    return probes[:: max(1, len(probes) // MOST_PROBES)]


def open_workbench(case: Case, begun: Mapping[str, float] = NOTHING) -> Workbench:
    """Build the regression with everything in it; its noise is what is left when all causes have taken their part.

    Parameters
    ----------
    begun : where straight lines are laid: sizes of causes, the others are nothing there, and the baseline's own
        unknowns. Where nothing is said they go through the baseline's fit.

    Raises
    ------
    ResultError : the baseline itself cannot be fitted.
    """
    if case.straight and not begun:
        begun = _baseline(case)
    every = (*case.effects, *case.profiles)
    extra = [begun_at(u, begun) for e in every for u in unknowns_of(e, prior=True)]
    added = {u.name for u in extra}
    own = {n: v for n, v in begun.items() if n not in added}
    full = case.regression(every, extra, start=own) if case.straight else case.regression(every, extra)
    causes = {n for e in every for n in scanned(e)}
    base = tuple(u.name for u in full.shared if u.name not in added)
    if case.straight:
        full = linearized(full)
    full = without_priors(full, causes)
    full = replace(full, unknowns=tuple(replace(u, start=0.0) if u.name in causes else u for u in full.unknowns))
    return Workbench(case, _ordered(full, base), base)


def _baseline(case: Case) -> Mapping[str, float]:
    """The baseline's fit on a straight line, laid again through what it gave where the model knocks."""
    begun = NOTHING
    for _ in range(1 + LINES * case.bent):
        found = solve(linearized(case.regression((), (), start=begun)), tolerance=LEAST_STEP)
        held = begun and all(abs(found.values[n] - v) < CLOSE * found.std[n] for n, v in begun.items())
        begun = found.values
        if held:
            break
    return begun


def _unended(u: Unknown) -> Unknown:
    """Without a physical end at zero: how far a baseline without its cause is driven is what a diagnosis is to see."""
    return replace(u, lower=-u.upper) if u.lower >= 0 and u.prior is None else u


def _ordered(full: Regression, base: Sequence[str]) -> Regression:
    """The baseline's shared unknowns come first: every step builds it so, and the tests rely on it."""
    if tuple(u.name for u in full.shared[: len(base)]) != tuple(base):
        raise ValueError("a step's regression must put the baseline's unknowns before those of effects")
    return full
