"""Verdicts on runs that are too few, too short or of one direction, and effects that they cannot show."""

from __future__ import annotations

import pytest

from tests.diagnosis.linear import CATALOG, SLOPE, Campaign, cause, judged, told
from vdyn_cli.diagnosis.detect.detection import detect, reachable_t
from vdyn_cli.diagnosis.next_tests.next_test import next_tests
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.effects import Effect


def test_too_few_runs_are_never_given_a_name() -> None:
    case, verdict = judged(Campaign(7, runs=2, hidden={"wind": 5.0}), fewest_runs=4)
    assert verdict.verdict == "not_testable"
    assert "2 runs are too few" in told(case, verdict)


def test_runs_all_one_way_name_what_does_not_turn_with_the_direction() -> None:
    _, verdict = judged(Campaign(8, hidden={"wave": 5.0}, one_way=True))
    assert verdict.verdict == "named"
    assert verdict.answer is not None
    assert verdict.answer.effects == ("wave",)


def test_runs_all_one_way_do_not_name_what_a_slope_at_their_start_imitates(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Effect, "begins_with_run", property(lambda effect: effect.name == "wave"))
    case, verdict = judged(Campaign(8, hidden={"wave": 5.0}, one_way=True))
    assert verdict.verdict == "not_testable"
    assert told(case, verdict).startswith("A wave would explain the misfit (p = ")
    assert [one.effects for one in verdict.confounded] == [("wave",)]
    assert judged(Campaign(8, hidden={"wave": 5.0}))[1].verdict == "named"


def test_runs_all_one_way_without_an_error_are_not_called_adequate() -> None:
    case, verdict = judged(Campaign(8, one_way=True))
    assert verdict.verdict == "not_testable"
    assert told(case, verdict).startswith("No other error detected (p = ")


def test_runs_all_one_way_name_neither_wind_nor_slope() -> None:
    case, verdict = judged(Campaign(8, hidden={"wind": 5.0}, one_way=True))
    assert verdict.verdict == "not_testable"
    assert "all runs used have the same direction" in told(case, verdict)
    assert told(case, verdict).startswith("A wind would explain the misfit (p = ")
    (test,) = next_tests(open_strategy(case), verdict)
    assert "out and back" in test.manoeuvre
    assert test.runs == 8


def test_short_runs_hold_too_little_evidence() -> None:
    case, verdict = judged(Campaign(9, runs=2, rows=18, hidden={"wind": 20.0}))
    assert verdict.verdict == "not_testable"
    assert "too few to certify an effect" in told(case, verdict)


def test_stated_values_are_no_pieces_of_evidence() -> None:
    """Each short run has two blocks, and a start with a prior."""
    case, verdict = judged(Campaign(9, runs=5, rows=12, hidden={"wind": 20.0}))
    assert verdict.detection.system.units == 15
    assert verdict.verdict == "not_testable"
    assert "10 blocks (effective number " in told(case, verdict)
    (test,) = next_tests(open_strategy(case), verdict)
    assert test.runs == 10


def test_an_effect_that_differs_between_runs_needs_runs_enough_for_the_level() -> None:
    warming = cause("warming", between=True)
    for level, runs, name in ((0.05, 8, "named"), (0.005, 8, "adequate"), (0.005, 10, "named")):
        _, verdict = judged(Campaign(1, runs=runs, hidden={"warming": 3.0}), *CATALOG, warming, level=level)
        assert verdict.verdict == name
        because = [i.because for i in verdict.untestable if i.effect == "warming"]
        assert ["too few to test it" in one for one in because] == [True] * (name == "adequate")


def test_a_level_that_the_units_cannot_reach_is_refused() -> None:
    _, verdict = judged(Campaign(10, hidden={"wind": 5.0}), level=1e-4)
    assert verdict.verdict == "not_testable"
    assert "cannot reach the level of 0.0001" in verdict.insufficient


def test_effects_that_would_not_be_visible_are_listed_with_the_bias_they_would_cause() -> None:
    _, verdict = judged(Campaign(11), *CATALOG, cause("copy_of_bend"), cause("nothing"))
    assert verdict.verdict == "adequate"
    (unseen,) = verdict.untestable  # what has no trace at all biases nothing
    assert unseen.effect == "copy_of_bend"
    assert unseen.because == "exactly collinear with bend"
    assert unseen.size == pytest.approx(10.0)  # half of the plausible range
    assert unseen.would_bias == {"bend": pytest.approx(30.0)}


def test_where_no_effect_would_be_visible_nothing_is_testable() -> None:
    case, verdict = judged(Campaign(13), cause("copy_of_bend"))
    assert verdict.verdict == "not_testable"
    assert "no candidate effect would be visible" in told(case, verdict)


def test_runs_that_last_next_to_no_time_give_no_name() -> None:
    case, verdict = judged(Campaign(7, hidden={"slope": 0.6}), too_short="no run lasts longer than 2 s")
    assert verdict.verdict == "not_testable"
    assert "no run lasts longer than 2 s; effects are confounded in runs this short" in told(case, verdict)


def test_an_effect_too_small_to_matter_at_its_largest_is_not_testable() -> None:
    bench = open_strategy(Campaign(13).setup(SLOPE, cause("wave", reach=0.05)))
    base = bench.fitted(())
    assert base is not None
    found = detect(bench, base)
    assert found.testable == ("slope",)
    assert reachable_t(bench.model, found.scores, "wave") < 3 < reachable_t(bench.model, found.scores, "slope")
