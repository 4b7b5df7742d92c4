"""An effect and its amplitude in a sentence."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from vdyn_cli.diagnosis.part.published_part import elsewhere, law_clause
from vdyn_cli.diagnosis.published_fields import interchangeable
from vdyn_cli.diagnosis.verdict_text import amplitude_text, is_plural, remainder_sentence, with_undetected_bias
from vdyn_cli.effects import catalog
from vdyn_cli.quantities.diagnosis import CurvePoint, Detectable, Diagnosis, FaultyPart, PartLaw
from vdyn_cli.quantities.parameters import Estimate


@pytest.mark.parametrize(
    ("effect", "value", "half", "says"),
    [
        ("headwind", 2.034, 0.12, "a headwind of 2.03 +- 0.12 m/s along the out direction"),
        ("torque_gain", 0.0101, 0.0021, "a drive torque with a wrong gain of 1.01 +- 0.21 %"),
        ("torque_delay", -0.0063, 0.0011, "a drive torque with a wrong delay of -0.0063 +- 0.0011 s"),
        ("brake_drag", 31.4, 2.8, "brakes that drag (31.4 +- 2.8 N)"),
        ("shaft_stiffness", -0.23, 0.015, "half-shaft stiffness that differs from the given one (-23.0 +- 1.5 %)"),
    ],
)
def test_the_size_follows_the_label(effect: str, value: float, half: float, says: str) -> None:
    (found,) = [e for e in catalog() if e.name == effect]
    (name, quantity), *_ = found.unknowns.items()
    size = Estimate(value, half / 2, (value - half, value + half), quantity.unit, quantity.meaning, effect)
    assert f"{found.label}{amplitude_text(found, {name: size})}" == says


def test_an_interval_off_its_value_is_stated_by_its_ends() -> None:
    """Half of it would suggest that it includes zero."""
    (found,) = [e for e in catalog() if e.name == "torque_drift"]
    (name, quantity), *_ = found.unknowns.items()
    size = Estimate(-0.0117, 0.009, (-0.0381, -0.0019), quantity.unit, quantity.meaning, "torque_drift")
    assert amplitude_text(found, {name: size}).startswith(" of -0.012 [-0.038, -0.002] N m/s")


@pytest.mark.parametrize(("half", "axles"), [(0.3, "; front -0.014, rear -0.386"), (1.2, "")])
def test_axles_that_differ_significantly_have_their_own_amplitudes(half: float, axles: str) -> None:
    """A damper that is worn at the rear only is not an effect of half the size on both axles."""
    found = next(e for e in catalog() if e.name == "asymmetric_damping")
    unknowns = {"damping_asymmetry": (-0.2, 0.06), "damping_asymmetry_balance": (-0.93, half)}
    sizes = {n: Estimate(v, h / 1.96, (v - h, v + h), "", "", found.name) for n, (v, h) in unknowns.items()}
    assert amplitude_text(found, sizes) == f" (-0.200 +- 0.060{axles})"


def test_shares_of_the_axles_are_in_percent_as_their_mean() -> None:
    found = next(e for e in catalog() if e.name == "load_crosstalk")
    unknowns = {"load_crosstalk": (0.02, 0.006), "load_crosstalk_balance": (0.9, 0.3)}
    sizes = {n: Estimate(v, h / 1.96, (v - h, v + h), "", "", found.name) for n, (v, h) in unknowns.items()}
    assert amplitude_text(found, sizes) == " (2.00 +- 0.60 %; front 3.80, rear 0.20)"


@pytest.mark.parametrize(
    ("answers", "sets"),
    [
        (("tilt loss", "zero loss", "tilt gain"), (("tilt", "zero"), ("loss", "gain"))),
        (("tilt loss", "zero loss", "tilt gain", "zero gain"), (("tilt", "zero"), ("loss", "gain"))),
        (("tilt loss", "zero loss", "zero gain"), ()),
        (("tilt loss", "loss"), ()),
    ],
)
def test_effects_that_replace_one_another_in_any_combination_are_sets(
    answers: tuple[str, ...], sets: tuple[tuple[str, ...], ...]
) -> None:
    assert interchangeable(*cast(Any, ([SimpleNamespace(effects=tuple(a.split())) for a in answers],))) == sets


PLURAL = (
    "accelerometer_slope", "asymmetric_damping", "brake_drag", "brake_drag_fading", "bump_stop", "degressive_damping",
    "front_load_gain", "load_crosstalk", "progressive_spring", "rear_load_delay", "rear_load_gain",
    "rear_tire_stiffness", "run_warmup", "series_compliance", "shaft_torque_delay", "tire_enveloping", "tire_warmup",
    "wheel_circle", "wheel_force_gain", "wheel_speed_delay",
)  # fmt: skip


def test_the_verb_agrees_with_every_label_of_the_catalog() -> None:
    assert tuple(e.name for e in catalog() if is_plural(e.label)) == PLURAL


def test_a_remainder_is_readable_and_small_only_where_it_is() -> None:
    assert remainder_sentence(0.304) == "A significant residual remains (30 % of the rms misfit)."
    assert remainder_sentence(0.04) == "A small significant residual remains (4 % of the rms misfit)."


def part_at_fault(law: PartLaw | None = None) -> FaultyPart:
    return FaultyPart(
        element="bearing", label="the bearing's drag torque", coordinate="wheel_speed", coordinate_unit="rad/s",
        unit="N m", curve=(), baseline=(), gauge="", share_of_rms=0.9, explains=True, law=law,
    )  # fmt: skip


def test_only_where_no_effect_is_named_no_law_follows_the_curve() -> None:
    """If each of several laws would explain the error, the catalog has a law for the curve."""
    part = part_at_fault()
    assert law_clause(part, None, None) == "no law of the catalog follows the curve"
    ends = [(2.9, 96.0, 15.0), (9.0, 3.0, 8.0), (19.5, -78.0, 8.0)]
    curve = tuple(CurvePoint(at=at, value=150.0 + v, interval95=(150.0 + v - h, 150.0 + v + h)) for at, v, h in ends)
    deviating = part.model_copy(update={"curve": curve, "baseline": (150.0, 150.0, 150.0)})
    says = "by +96 +- 15 N m at 2.9 rad/s and -78.0 +- 8.0 N m at 19.5 rad/s"
    assert law_clause(deviating, None, None).endswith(f"which deviates from the model's refitted law {says}")
    both = law_clause(part, None, ("brakes that drag", "bearing drag"))
    assert both == "of the named effects, these act on it: brakes that drag, bearing drag"
    other = elsewhere(part, "speed")
    assert other.endswith("over speed would also explain the error; no named effect acts on that part.")


@pytest.mark.parametrize(("bias", "half", "is_stated"), [(0.19, 0.02, True), (0.19, 0.2, False), (0.01, 0.005, False)])
def test_a_large_bias_by_an_undetected_effect_is_stated(bias: float, half: float, is_stated: bool) -> None:
    slope = Detectable(
        effect="speed_dependent_rolling", label="rolling resistance that increases with speed", amplitude=1.8e-4,
        unit="s/m", would_bias={"drag_area": bias, "rolling_resistance": -1e-5},
    )  # fmt: skip
    adequate = Diagnosis(verdict="adequate", sentence="No model error detected.", p_value=0.5, detectable=(slope,))
    area = Estimate.of("drag_area", 0.55, half / 2, (0.55 - half, 0.55 + half), "coastdown")
    zero = Estimate.of("drag_area", 0.0, half / 2, (-half, half), "coastdown")
    assert with_undetected_bias(adequate, {"drag_area": zero}) == adequate
    sentence = with_undetected_bias(adequate, {"drag_area": area}).sentence
    stated = (
        " These data would not show rolling resistance that increases with speed below 0.00018 s/m; drag area would"
    )
    assert sentence == "No model error detected." + (
        stated + " then be wrong by up to 35 %, more than its interval." if is_stated else ""
    )
