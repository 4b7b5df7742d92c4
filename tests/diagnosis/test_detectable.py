"""Detectable amplitudes of an adequate model: an effect of that amplitude is detected about nine times in ten."""

from __future__ import annotations

import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.detect.detectability import detectable
from vdyn_cli.diagnosis.detect.detection import detect
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy

CATALOG = (cause("slope"), cause("wind"), cause("wave"), cause("step"))


@pytest.mark.slow  # a Monte Carlo run or several fits
def test_the_stated_amplitude_is_detected_about_nine_times_in_ten() -> None:
    found = []
    for seed in range(300, 320):
        setup = Campaign(seed).setup(*CATALOG, level=0.05)
        strategy = open_strategy(setup)
        base = strategy.fitted(())
        assert base is not None
        smallest = {d.effect: d.amplitude for d in detectable(strategy.model, base, detect(strategy, base))}
        assert set(smallest) <= {c.name for c in CATALOG}
        name = CATALOG[seed % 4].name
        strategy = open_strategy(Campaign(seed, hidden={name: smallest[name]}).setup(*CATALOG, level=0.05))
        base = strategy.fitted(())
        assert base is not None
        found.append(detect(strategy, base).p_value <= 0.05)
    assert sum(found) >= 14  # of 20 with a chance of 0.9: 13 or fewer have a probability of 0.2 %
