"""A wheel's speed times its radius against the car's speed, as ``vdyn check`` compares them."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.project.checks.redundancy import compared_over_runs, contradicted_radius, tied_pairs
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters

RADIUS = 0.31  # m, of the wheel that turned


def _run(name: str) -> Log:
    """A car that speeds up and slows down with 0.5 % of slip to either side, and sensors with noise of 0.2 %."""
    rng, time = np.random.default_rng(len(name)), np.arange(0.0, 30.0, 0.01)
    speed = 15.0 + 8.0 * np.sin(0.4 * time)
    turned = speed / RADIUS * (1.0 + 0.005 * np.cos(0.4 * time))
    channels = {"vehicle_speed": speed + rng.normal(0.0, 0.03, time.size)}
    return Log(name, time, channels | {"wheel_speed": turned + rng.normal(0.0, 0.1, time.size)})


def _known(share: float, std: float) -> Parameters:
    value = share * RADIUS
    return Parameters({"wheel_radius": Estimate(value, std, (value - 2 * std, value + 2 * std), "m", "", "")})


@pytest.mark.parametrize(
    ("share", "std", "agrees"),
    [(1.0, 0.0005, True), (0.97, 0.0005, False), (1.028, 0.0005, False), (0.98, 0.004, True)],
)
def test_a_radius_that_the_speeds_contradict_is_reported(share: float, std: float, agrees: bool) -> None:
    pairs = [pair for name in ("a", "bb") for pair in tied_pairs(_run(name), _known(share, std))]
    _, findings = compared_over_runs(pairs)
    assert [pair.good for pair in pairs] == [agrees, agrees]
    assert [f.where for f in findings] == ([] if agrees else ["wheel_speed and vehicle_speed"])
    assert all(f"{share:.3f} times vehicle_speed in all 2 runs that show it" in f.what for f in findings)


def test_the_lever_of_a_hub_force_may_lie_below_the_rolling_radius() -> None:
    runs = [_run(name).with_channels(hub_force_x=np.zeros(3000)) for name in ("a", "bb")]
    found = {share: contradicted_radius(runs, _known(share, 0.0005), (), ()) for share in (0.92, 0.96, 1.028)}
    assert [share for share, findings in found.items() if findings] == [0.92, 1.028]


def test_a_radius_is_judged_alike_in_all_runs() -> None:
    """Of three gains of 2 % the limit lies between, most decide."""
    pairs = [pair for name in ("a", "bb", "ccc") for pair in tied_pairs(_run(name), _known(0.98, 0.0005))]
    mixed = [pair.model_copy(update={"good": pair.run == "a"}) for pair in pairs]
    judged, findings = compared_over_runs(mixed)
    assert [pair.good for pair in judged] == [False, False, False]
    assert len(findings) == 1


def test_a_speed_computed_from_a_wheel_is_not_compared_with_it() -> None:
    computed = [("wheel_speed", "vehicle_speed")]
    assert list(tied_pairs(_run("a"), _known(1.0, 0.0005), computed)) == []


def test_all_wheels_with_one_wrong_radius_are_one_finding() -> None:
    wheels = ("wheel_speed_fl", "wheel_speed_fr")
    runs = [_run(name) for name in ("a", "bb")]
    runs = [Log(r.name, r.time, {"speed": r["vehicle_speed"], **dict.fromkeys(wheels, r["wheel_speed"])}) for r in runs]
    (found,) = contradicted_radius(runs, _known(0.95, 0.0005), (), ())
    assert found.doubt
    assert found.what == f"{', '.join(wheels)} * wheel_radius is 0.950 times speed in all 2 runs that show it"


def test_the_gain_of_a_coast_includes_the_uncertainty_of_the_clocks() -> None:
    """V = 20 m/s exp(-t / 20 s): a delay of 0.4 s changes the ratio by 2 %."""
    time = np.arange(0.0, 20.0, 0.05)
    speed = 20.0 * np.exp(-time / 20.0)
    log = Log("a", time, {"speed": speed, "wheel_speed": 1.03 * speed / RADIUS})
    clock = {"run": "a", "logger": "b", "pair": ("speed", "wheel_speed"), "delay": 0.0, "at": 0.0, "drift": 0.0}
    clock |= {"drift_std": 0.0, "corrected": False, "gain": 1.0, "offset": 0.0, "channels": ("wheel_speed",)}
    judged = [
        next(tied_pairs(log, _known(1.0, 0.0005), (), [ClockDifference(delay_std=std, **clock)])).good
        for std in (0.01, 0.4)
    ]
    assert judged == [False, True]
