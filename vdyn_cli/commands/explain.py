"""`vdyn explain` and `vdyn list`: texts on steps, effects, parameters and channels, from their documentation."""

from __future__ import annotations

import inspect
import re
from collections.abc import Mapping, Sequence

from vdyn_cli import steps
from vdyn_cli.commands.glossary import glossary
from vdyn_cli.effects import Effect, candidates, catalog, refused_effects
from vdyn_cli.quantities.errors import Finding, InputError, did_you_mean, raise_all
from vdyn_cli.quantities.parameters import ESTIMATED_BY
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.quantities.vocabulary import CHANNELS, PARAMETERS
from vdyn_cli.steps import Step

PAGES = ("glossary", "policy")  # topics with one page each
MOST_LISTED = 6  # largest number of unknowns of an effect that are all listed
_SHORTEST = 4  # letters of a word that is searched in texts
_MOST_NAMED = 5  # topics with a word in their name that a message names


def closest_topic(name: str, known: Sequence[str], kind: str, texts: Mapping[str, str] | None = None) -> str:
    """Return the name if it is known.

    Parameters
    ----------
    texts : of topics, in which a name like none is searched, such as roofbox.

    Raises
    ------
    InputError : the name is unknown; the remedy lists the closest names.
    """
    if name in known:
        return name
    parts = [one for one in known if name.lower() in one.split("_")]  # such as rolling_resistance for rolling
    parts = sorted(parts, key=lambda one: not one.startswith(name.lower()))[:_MOST_NAMED]
    said = [one for one, text in (texts or {}).items() if _letters(name) in _letters(text)][:_MOST_NAMED]
    otherwise = f"see 'vdyn explain {' or '.join(said)}'" if said and len(name) >= _SHORTEST else "see 'vdyn list'"
    remedy = f"did you mean {' or '.join(parts)}?" if parts else did_you_mean(name, known, otherwise)
    raise InputError(Finding(name, f"{kind} unknown", remedy=remedy))


def _letters(text: str) -> str:
    return re.sub(r"[\W_]", "", text.lower())


def raise_refused(name: str) -> None:
    """Check that the effect of that name, if a package provides it, is in the catalog.

    Raises
    ------
    InputError : the package's effect cannot be used; the message says why.
    """
    raise_all(f for f in refused_effects() if f", plug-in {name} (" in f.where)


def explanation(topic: str) -> str:
    """The documentation of a step, an effect, a parameter or a channel, the glossary, or the diagnosis policy.

    Raises
    ------
    InputError : the topic is unknown.
    """
    if topic == "glossary":
        return glossary()
    if topic == "policy":
        return _policies()
    effects = {e.name: e for e in catalog()}
    quantities = CHANNELS | PARAMETERS
    raise_refused(topic)
    texts = {name: f"{e.label} {e.signature} {e.confirm}" for name, e in effects.items()}
    texts |= {name: f"{q.meaning} {texts.get(name, '')}" for name, q in quantities.items()}
    closest_topic(topic, (*steps.names(), *effects, *quantities, *PAGES), "step, effect or parameter", texts)
    found = [_step(topic)] if topic in steps.names() else []
    found += [_quantity(quantities[topic])] if topic in quantities else []
    found += [_effect(effects[topic])] if topic in effects else []
    return "\n\n".join(found)  # wheel_radius is a parameter and a candidate effect


def _policies() -> str:
    from vdyn_cli.diagnosis.policy import POLICY
    from vdyn_cli.io.clocks.clock_policy import CLOCKS
    from vdyn_cli.io.quality.quality_policy import QUALITY
    from vdyn_cli.project.checks.check_policy import CHECK
    from vdyn_cli.quantities.threshold import thresholds_text
    from vdyn_cli.steps.step_policy import STEP_POLICY

    policies = {
        "Diagnosis": POLICY,
        "Quality of the logs": QUALITY,
        "Clocks of several loggers": CLOCKS,
        "Check of the runs (vdyn check)": CHECK,
        "Several steps": STEP_POLICY,
        **{f"Step {name}": steps.load_step(name).policy for name in steps.names()},
    }
    return "\n".join(f"{title}\n\n{thresholds_text(one)}" for title, one in policies.items() if one is not None)


def _step(name: str) -> str:
    step = steps.load_step(name)
    lines = [
        f"vdyn {name} TEST.yaml",
        "",
        steps.explanation(name).strip(),
        "",
        f"channels: {', '.join(step.required) or 'none'}",
        f"optional: {', '.join(step.optional) or 'none'}",
        *(f"  {one.equation}, where {one.target} is not mapped" for one in step.scaled),
        f"reads:    {_read_keys(step)}",
        f"estimates: {', '.join(step.gives) or 'no parameters'}",
    ]
    return "\n".join(lines)


def _read_keys(step: Step) -> str:
    """Parameters of other steps, the vehicle and the air that a step reads."""
    keys = dict.fromkeys((*step.needs, *(step.reads or ())))
    return ", ".join((*keys, *(["and any other parameter"] if step.reads is None else []))) or "no parameters"


def _effect(effect: Effect) -> str:
    """Law, unknowns, signature in the data, similar effects, test that would confirm it, and source."""
    fault = ", a sensor fault" if effect.sensor else ""
    shows = "within a run" if effect.kind == "within_run" else "between runs only"
    keeps = "belongs to the vehicle" if effect.lasts else "belongs to the test"
    lines = [
        f"{effect.name}, a candidate effect: {effect.label}{fault}",
        f"changes {_changed(effect)}; visible {shows}; {keeps}",
        "",
        inspect.cleandoc(effect.law.__doc__ or effect.summary),
        "",
        *_ranges(effect),
        f"candidate in: {', '.join(_tested_in(effect)) or 'no installed step'}",
        f"signature in the data: {effect.signature}",
        f"similar effects: {', '.join(effect.alike) or 'none known'}",
        f"how to confirm it: {effect.confirm}",
        f"source: {effect.reference}",
    ]
    return "\n".join(lines)


def _changed(effect: Effect) -> str:
    laws = "law" if len(effect.on) == 1 else "laws"
    return "the model's parameters" if effect.on == ("parameters",) else f"the {laws} {', '.join(effect.on)}"


def _tested_in(effect: Effect) -> list[str]:
    """Names of the steps that test the effect."""
    steps_found = _loaded()[0]
    return [s.name for s in steps_found if effect in _candidates(s)]


def _candidates(step: Step) -> list[Effect]:
    """The effects that a step tests, in any of its manoeuvres."""
    every = [one for one in (step, *step.manoeuvres.values()) if one.diagnosable is not None]
    return [e for one in every for e in candidates(one.situations)]


def _loaded() -> tuple[list[Step], list[Finding]]:
    """Every step that can be imported, and the findings on those that cannot, so that these do not stop the list."""
    found: list[Step] = []
    broken: list[Finding] = []
    for name in steps.names():
        try:
            found.append(steps.load_step(name))
        except InputError as error:
            broken += error.findings
    return found, broken


def _ranges(effect: Effect) -> list[str]:
    """A line for each unknown; if there are more than MOST_LISTED, for the first and the last."""
    lines = [_range(q, effect.nominal.get(q.name)) for q in effect.unknowns.values()]
    return lines if len(lines) <= MOST_LISTED else [lines[0], "  ...", lines[-1]]


def _range(quantity: Quantity, nominal: float | None) -> str:
    usual = f", nominal {nominal:g}" if nominal is not None else ""
    return f"  {quantity.name}: {quantity.meaning}, {quantity.range_text}{usual}"


def _quantity(quantity: Quantity) -> str:
    kind = "parameter" if quantity.name in PARAMETERS else "channel"
    symbol = f" ({quantity.symbol})" if quantity.symbol else ""
    lines = [f"{quantity.name}, a {kind}{symbol}: {quantity.meaning}", f"unit: {quantity.unit or '1'}"]
    lines.append(f"accepted: {quantity.range_text}")
    if quantity.name in ESTIMATED_BY:
        lines.append(f"estimated by: vdyn {ESTIMATED_BY[quantity.name]}")
    return "\n".join(lines)


def _optional(step: Step) -> str:
    return f"; optional {', '.join(step.optional)}" if step.optional else ""


def listing() -> str:
    """The steps with their channels, and the effects."""
    lines = ["steps"]
    found, broken = _loaded()
    for step in found:
        lines += [
            f"  {step.name:<10} {steps.summary(step.name)}",
            f"             reads {', '.join(step.required) or 'no log'}{_optional(step)}",
            f"             estimates {', '.join(step.gives) or 'no parameters'}",
        ]
    lines.append("candidate effects, with the steps that test them (see 'vdyn explain NAME')")
    wanted = {s.name: _candidates(s) for s in found}
    for e in catalog():
        fault = " (sensor)" if e.sensor else ""
        lines += [f"  {e.name:<24} {e.label}{fault}: {', '.join(n for n, of in wanted.items() if e in of)}"]
    return "\n".join([*lines, *(str(f) for f in (*broken, *refused_effects()))])
