"""Six verdicts on campaigns with known truth, and their sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.diagnosis.linear import CATALOG, SLOPE, STEP, WAVE, WIND, Campaign, cause, judged, told
from vdyn_cli.diagnosis.detect.detection import detect
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_judgment import judge
from vdyn_cli.diagnosis.name.candidate_models import candidate_model, catalog_falls_short, pairs
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.inference import Regression, Unknown
from vdyn_cli.quantities.errors import Finding


@pytest.mark.parametrize("seed", range(8))
def test_nothing_hidden_is_adequate(seed: int) -> None:
    case, verdict = judged(Campaign(200 + seed))
    assert verdict.verdict == "adequate"
    assert verdict.answer is None
    assert "No model error detected" in told(case, verdict)
    assert f"p = {verdict.detection.p_value:.2g}" in told(case, verdict)


@pytest.mark.parametrize(("hidden", "short"), [({"bump": 30.0}, True), ({"wave": 30.0, "step": 20.0}, False)])
def test_pairs_are_tried_only_where_the_whole_catalog_could_do(hidden: dict[str, float], short: bool) -> None:
    strategy = open_strategy(Campaign(7, hidden=hidden).setup(*CATALOG))
    tried = [candidate_model(strategy, (e.name,)) for e in CATALOG]
    best = min((t for t in tried if t is not None), key=lambda t: t.cost)
    assert catalog_falls_short(strategy, best) is short


def test_what_needs_no_other_is_tried_alone_however_little_it_showed() -> None:
    strategy = open_strategy(Campaign(7, hidden={"wave": 3.0}).setup(*CATALOG))
    base = strategy.fitted(())
    assert base is not None
    tried = [m.effects for m in pairs(strategy, (), detect(strategy, base))]
    assert tried == [("wave",)]


@pytest.mark.parametrize("runs", [8, 18])
@pytest.mark.parametrize("hidden", ["slope", "wind", "wave", "step"])
def test_a_hidden_effect_is_named_with_its_amplitude(hidden: str, runs: int) -> None:
    size = {"slope": 0.6, "wind": 2.0, "wave": 1.0, "step": 1.5}[hidden]
    case, verdict = judged(Campaign(7, runs=runs, hidden={hidden: size}))
    assert verdict.verdict == "named"
    assert verdict.answer is not None
    assert verdict.answer.effects == (hidden,)
    solution = verdict.answer.fitted.solution
    assert abs(solution.values[hidden] - size) < 4 * solution.std[hidden]
    assert verdict.gain is not None
    assert verdict.gain.interval[0] > 0
    assert verdict.gain.folds == runs
    assert told(case, verdict).startswith(f"A {hidden} explains ")


def test_an_effect_that_differs_between_runs_is_named() -> None:
    _, verdict = judged(Campaign(1, hidden={"warming": 1.0}), *CATALOG, cause("warming", between=True))
    assert verdict.verdict == "named"
    assert verdict.answer is not None
    assert verdict.answer.effects == ("warming",)


def test_an_effect_between_too_few_runs_is_not_certified_by_itself() -> None:
    warming = cause("warming", between=True)
    _, verdict = judged(Campaign(1, runs=4, hidden={"warming": 2.0}), warming, profiles=())
    assert verdict.verdict == "not_testable"
    assert [i.effect for i in verdict.untestable] == ["warming"]
    _, verdict = judged(Campaign(1, runs=4, hidden={"warming": 2.0}), warming, *CATALOG)
    assert (verdict.verdict, verdict.answer) == ("adequate", None)


def test_two_effects_with_one_sensitivity_are_ambiguous() -> None:
    case, verdict = judged(Campaign(2, hidden={"wind": 2.0}), *CATALOG, cause("wind_twin"))
    assert verdict.verdict == "ambiguous"
    assert {t.effects for t in verdict.answers} == {("wind",), ("wind_twin",)}
    assert verdict.answer is None
    assert verdict.gain is None
    assert "a wind" in told(case, verdict)
    assert "cannot discriminate between them" in told(case, verdict)


def test_what_comes_closest_is_what_explains_most_in_whatever_order_answers_were_found() -> None:
    _, verdict = judged(Campaign(2, hidden={"wind": 2.0}), *CATALOG, cause("wind_twin"))
    most = min(verdict.answers, key=lambda t: t.fitted.solution.cost)
    for answers in (verdict.answers, verdict.answers[::-1]):
        refuted = replace(verdict, accepted=answers).refuted("it is not")
        assert (refuted.verdict, refuted.refutation, refuted.answers) == ("unknown", "it is not", ())
        assert refuted.closest is most


def test_a_shape_outside_the_catalog_is_unknown() -> None:
    case, verdict = judged(Campaign(3, hidden={"bump": 2.0}))
    assert verdict.verdict == "unknown"
    assert verdict.answers == ()
    assert "no candidate effect explains the misfit" in told(case, verdict)


def test_two_effects_at_once_are_both_named() -> None:
    case, verdict = judged(Campaign(4, hidden={"slope": 0.8, "wave": 0.8}))
    assert verdict.verdict == "named"
    assert verdict.answer is not None
    assert verdict.answer.effects == ("slope", "wave")
    assert "A slope and a wave explain " in told(case, verdict)


@pytest.mark.parametrize("hidden", [{}, {"wind": 2.0}])
def test_beside_a_sensor_that_did_not_measure_nothing_is_right_and_nothing_else_wrong(hidden: dict[str, float]) -> None:
    stuck = Finding("run_2.csv, column 'V'", "holds one value all through", fault=True, doubt=True)
    case, _ = judged(Campaign(3, hidden=hidden))
    verdict = judge(open_strategy(case), [stuck])
    assert verdict.verdict == "data_fault"
    assert verdict.fault == "run_2.csv, column 'V' holds one value all through"
    assert not verdict.answers


def test_a_sensor_is_a_fault_of_the_data() -> None:
    case, verdict = judged(Campaign(5, hidden={"wind": 2.0}), SLOPE, cause("wind", sensor=True), WAVE, STEP)
    assert verdict.verdict == "data_fault"
    assert verdict.answer is not None
    assert told(case, verdict).startswith("Data fault: a wind")


@pytest.mark.parametrize("linearized", [False, True])
def test_an_effect_beyond_its_plausible_range_is_not_named(linearized: bool) -> None:
    small = cause("wind", reach=1.0)
    case, verdict = judged(Campaign(6, hidden={"wind": 2.0}), SLOPE, small, WAVE, STEP, linearized=linearized)
    assert verdict.verdict == "unknown"
    assert verdict.beyond_range is not None
    assert "A wind comes closest, but its amplitude is beyond the plausible range" in told(case, verdict)


def test_an_effect_of_the_wrong_sign_is_not_named() -> None:
    """Its range extends beyond zero only for the noise of the estimate."""
    friction = cause("wind", least=-2.9)
    for size, name in ((2.0, "named"), (-2.0, "unknown")):
        assert judged(Campaign(6, hidden={"wind": size}), SLOPE, friction, WAVE, STEP)[1].verdict == name


class Physical(Campaign):
    """Its bend cannot be negative."""

    def regression(self, extra: Sequence[Unknown] = ()) -> Regression:
        full = super().regression(extra)
        ended = tuple(replace(u, lower=0.0, start=1.0) if u.name == "bend" else u for u in full.unknowns)
        return replace(full, unknowns=ended)


@pytest.mark.parametrize("size", [-20.0, 20.0])
def test_a_baseline_that_leaves_what_is_physical_is_diagnosed(size: float) -> None:
    """Without the wave, the bend is estimated as -16: the error that the wave explains, and no reason to stop."""
    campaign = Physical(6, hidden={"bend": 0.5, "wave": size})
    bench = open_strategy(campaign.setup(*CATALOG))
    base = bench.fitted(())
    assert base is not None
    assert (base.values["bend"] < 0) is (size > 0)
    verdict = judge(bench)
    assert verdict.answer is not None
    assert verdict.answer.effects == ("wave",)
    assert verdict.answer.fitted.values["bend"] > 0


def test_a_latency_is_a_property_of_the_logger_and_no_fault() -> None:
    case, verdict = judged(Campaign(5, hidden={"wind": 2.0}), SLOPE, cause("wind", sensor=True, late=True), WAVE, STEP)
    assert verdict.verdict == "named"
    assert told(case, verdict).startswith("A wind")


def test_what_two_runs_tell_is_not_taken_for_certain() -> None:
    """Two runs fit two unknowns exactly, so that they have no scatter."""
    bench = open_strategy(Campaign(21, runs=2, rows=400).setup(SLOPE))
    fitted = bench.fitted(("slope",))
    assert fitted is not None
    assert fitted.solution.std["slope"] == pytest.approx(fitted.solution.classical_std["slope"], rel=0.5)


ONE, OTHER = (cast(Any, SimpleNamespace(sensor_fault=False)) for _ in range(2))
SENSOR = cast(Any, SimpleNamespace(sensor_fault=True))


@pytest.mark.parametrize(
    ("evidence", "verdict"),
    [
        ({}, "adequate"),
        ({"material": False, "accepted": (ONE,)}, "adequate"),
        ({"material": True}, "unknown"),
        ({"material": True, "accepted": (ONE,)}, "named"),
        ({"material": True, "accepted": (ONE, OTHER)}, "ambiguous"),
        ({"material": True, "accepted": (SENSOR,)}, "data_fault"),
        ({"fault": "it is constant", "insufficient": "too few"}, "not_testable"),
        ({"fault": "it is constant"}, "data_fault"),
        ({"material": True, "accepted": (ONE,), "one_way": "one direction"}, "not_testable"),
    ],
)
def test_the_verdict_follows_from_the_evidence(evidence: dict[str, Any], verdict: str) -> None:
    judgment = Judgment(cast(Any, None), cast(Any, None), **evidence)
    assert judgment.verdict == verdict
    assert bool(judgment.answers) is (verdict in ("named", "ambiguous") or SENSOR in judgment.accepted)
    assert judgment.confounded == (judgment.accepted if judgment.one_way else ())
    assert judgment.immaterial is (ONE if judgment.material is False else None)


def test_numbers_are_finite() -> None:
    _, verdict = judged(Campaign(15, hidden={"wind": 2.0}))
    found = verdict.detection
    assert all(math.isfinite(v) for v in found.scores.statistic.values())
    assert 0 < found.scores.smallest_p() < 1e-3
    assert found.system.effective_units > 6


@pytest.mark.parametrize("runs", [6, 18])
def test_one_pass_over_the_logs_does_for_straight_lines(runs: int) -> None:
    """A regression linearized at its start, with runs compressed by block, is the same for a linear model."""
    _, whole = judged(Campaign(16, runs=runs, hidden={"wind": 2.0}))
    _, folded = judged(Campaign(16, runs=runs, hidden={"wind": 2.0}), linearized=True)
    assert folded.verdict == whole.verdict == "named"
    assert folded.answer is not None
    assert whole.answer is not None
    assert folded.answer.fitted.values["wind"] == pytest.approx(whole.answer.fitted.values["wind"], rel=0.02)
    assert folded.gain is not None
    assert whole.gain is not None
    assert folded.gain.before == pytest.approx(whole.gain.before, rel=1e-3)
    assert folded.gain.after == pytest.approx(whole.gain.after, rel=1e-3)
    assert folded.gain.share == pytest.approx(whole.gain.share, abs=0.02)


@pytest.mark.parametrize(("unlisted", "name"), [(1.5, "named"), (30.0, "unknown")])
def test_a_large_effect_is_named_though_its_law_is_not_exact(unlisted: float, name: str) -> None:
    large = cause("wave", reach=200.0)
    case, verdict = judged(Campaign(4, hidden={"wave": 120.0, "bump": unlisted}), SLOPE, WIND, large, STEP)
    assert verdict.verdict == name
    if name == "named":
        assert verdict.answer is not None
        assert verdict.answer.effects == ("wave",)
        assert not verdict.answer.sufficient
        assert told(case, verdict).endswith("of the rms misfit).")


def test_a_law_that_also_fits_what_a_simple_one_leaves_is_not_named_alone() -> None:
    """A constant force that is not quite constant does not prove a slow decay."""
    simple, more = cause("wave", reach=200.0), cause("wavy", ("wave_again", "bump"), reach=200.0)
    campaign = Campaign(4, hidden={"wave": 120.0, "bump": 1.5})
    _, verdict = judged(campaign, SLOPE, WIND, STEP, simple, more)
    assert verdict.verdict == "ambiguous"
    assert [a.effects for a in verdict.answers] == [("wave",), ("wavy",)]


def test_two_errors_that_hid_each_other_are_reported() -> None:
    """A level stated too high hides half of a step: with the step, predictions with that level are worse."""
    stated = {"level": (4.0, 0.3), "bend": (-2.0, 0.3)}
    campaign = Campaign(18, runs=12, hidden={"step": 1.0}, priors=stated)
    case, verdict = judged(campaign, SLOPE, WIND, STEP, linearized=True)
    assert verdict.verdict == "named"
    assert verdict.answer is not None
    assert verdict.answer.effects == ("step",)
    assert verdict.gain is not None
    assert verdict.gain.prediction_worse
    assert verdict.gain.refitted
    assert verdict.gain.positive  # of refitted models: no cause without a gain is named
    assert not verdict.gain.worse
    assert told(case, verdict).endswith("a stated parameter has an error that the effect had compensated.")
