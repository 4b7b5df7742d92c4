"""The verdict as one sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from vdyn_cli.diagnosis.gain.held_out_gain import HeldOutGain
from vdyn_cli.diagnosis.judgment import HELD_OUT_WORSE, NO_GAIN, Judgment, NuisanceError
from vdyn_cli.diagnosis.published_fields import interchangeable
from vdyn_cli.diagnosis.strategies.effect_unknowns import bounds_of
from vdyn_cli.effects import Effect
from vdyn_cli.quantities.diagnosis import Detectable, Diagnosis, Size
from vdyn_cli.quantities.number_text import capitalized, decimals, listed, two_digits
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.unit_mistakes import usual_mistake

# These choose words, no verdict.
SHOWN = 4  # effects named in one sentence
REVEALED = 2  # smallest errors that an adequate model would have revealed
PLAIN = (1e-3, 1e5)  # amplitudes that read as plain numbers in a sentence
# A factor equals a known one if they differ by less than its interval (at least 1 %) and by less than 6 %.
SAME_FACTOR, UNLIKE_FACTOR = 0.01, 0.06
MANY_TIMES = 1.5  # a scale that is off by more is also stated as a factor
SMALL_REMAINDER = 0.1  # share of the rms misfit, below which a significant residual is called small
IMMATERIAL = "The residual is significant, but too small to matter for predictions."
PART = "part of the rms error"  # of an answer whose held-out gain is not known or not certain
AFTER_THE_NOUN = ("that", "with", "in", "of", "from", "between")  # words after the noun that a label is about
CLAUSE = ("that", "another")  # after a label with one of these words, the amplitude stands in brackets
LARGE_BIAS = 0.05  # of a parameter: a smaller one by an undetected effect stands in the report only
OFF_CENTER = 0.2  # of half an interval, distance of its middle from the value, above which its ends are stated


def verdict_sentence(
    judgment: Judgment,
    effects: Mapping[str, Effect],
    amplitudes: Mapping[str, Estimate],
    narrowed: bool = False,
    size: Size | None = None,
    shown: Sequence[Detectable] = (),
) -> str:
    """The verdict as a sentence, with the size of the finding or the smallest detectable errors.

    Parameters
    ----------
    effects : the candidates by name.
    amplitudes : by unknown of the effects that were named or added to the model.
    narrowed : whether the description restricts the candidates.
    size : of the finding.
    shown : detectable amplitudes, for an adequate model.
    """
    text = _sentence(judgment, effects, amplitudes)
    if judgment.material is False:
        text = _immaterial(judgment, effects, amplitudes, size)
    elif judgment.verdict == "unknown" and size is not None and judgment.closest is not None:
        text += f" Effect of the closest candidate on the {_size(size, ': ')}."
    elif judgment.answer is not None and size is not None and _explained(judgment) == PART:
        text += f" Effect on the {_size(size, ': ')}."
    if judgment.nuisance is not None:
        text += _nuisance(judgment.nuisance, effects, amplitudes)
    readable = [d for d in shown if PLAIN[0] < d.amplitude < PLAIN[1]]
    revealed = [f"{d.label} ({_amount(d)})" for d in readable[:REVEALED]]
    if revealed:
        text += f" Smallest errors these data could reveal: {' and '.join(revealed)}."
    if narrowed and effects:
        text += f" Only {', '.join(effects)} {'was' if len(effects) == 1 else 'were'} tested."
    return text


def with_undetected_bias(diagnosis: Diagnosis, published: Mapping[str, Estimate]) -> Diagnosis:
    """The diagnosis whose sentence states the undetected effect that biases a parameter most beyond its interval.

    The bias is that by an effect of the smallest detectable amplitude. Nothing is added if it is small or in the
    interval, or if the parameter may be zero, so that a share of it says nothing.
    """
    beyond = []
    for smallest in diagnosis.detectable:
        for name in smallest.would_bias.keys() & published.keys():
            one, bias = published[name], abs(smallest.would_bias[name])
            if bias > max(one.half_width, LARGE_BIAS * abs(one.value)) and abs(one.value) > one.half_width > 0:
                beyond.append((bias / one.half_width, name, smallest))
    if not beyond:
        return diagnosis
    _, name, smallest = max(beyond, key=lambda entry: entry[:2])
    percent = 100.0 * smallest.would_bias[name] / published[name].value
    text = (
        f" These data would not show {smallest.label} below {_amount(smallest)}; {name.replace('_', ' ')} would then be"
        f" wrong by up to {abs(percent):.2g} %, more than its interval."
    )
    return diagnosis.model_copy(update={"sentence": diagnosis.sentence + text})


def _nuisance(nuisance: NuisanceError, effects: Mapping[str, Effect], amplitudes: Mapping[str, Estimate]) -> str:
    """The sentence on a sensor error that the baseline contains."""
    label, late = _with_amplitude(effects[nuisance.model.effects[-1]], amplitudes), two_digits(nuisance.expected)
    usual = f": channels of a logger may differ by up to {late} s, which the fit corrects"
    return f" {capitalized(label)} is part of the fit{usual if nuisance.expected else ' and does not matter'}."


def _amount(smallest: Detectable) -> str:
    """The detectable amplitude, "9 N" or "12 %"."""
    value, unit = (smallest.amplitude, smallest.unit) if smallest.unit else (100.0 * smallest.amplitude, "%")
    return f"{two_digits(value)} {unit}"


def p_text(p: float) -> str:
    """A p value as ``p = 0.76``."""
    return f"p = {p:.2g}" if p >= 1e-3 else f"p = {p:.1g}"


def _sentence(judgment: Judgment, effects: Mapping[str, Effect], amplitudes: Mapping[str, Estimate]) -> str:
    p = p_text(judgment.detection.p_value)
    if judgment.verdict == "adequate":
        return f"No model error detected ({p})."
    if judgment.one_way:
        label = " with ".join(effects[e].label for answer in judgment.confounded for e in answer.effects)
        found = f"{capitalized(label)} would explain the misfit" if label else "No other error detected"
        return f"{found} ({p}), but {judgment.one_way}: wind, slope and resistance are confounded."
    if judgment.verdict == "not_testable":
        return not_possible(judgment.insufficient)
    if judgment.verdict == "unknown":
        return f"Unmodeled effect present ({p}): {_closest(judgment, effects, amplitudes)}"
    if judgment.verdict == "ambiguous":
        return _ambiguous(judgment, effects, amplitudes)
    if judgment.answer is None:
        return data_fault(judgment.fault)
    answer = judgment.answer
    named = " and ".join(_with_amplitude(effects[e], amplitudes) for e in answer.effects)
    several = len(answer.effects) > 1 or is_plural(effects[answer.effects[0]].label)
    text = f"{named} {'explain' if several else 'explains'} {_explained(judgment)}.{_compensated(judgment.gain)}"
    if not answer.sufficient:
        text += f" {IMMATERIAL if answer.residual_immaterial else remainder_sentence(answer.residual_share)}"
    return f"Data fault: {text}" if judgment.verdict == "data_fault" else capitalized(text)


def _closest(judgment: Judgment, effects: Mapping[str, Effect], amplitudes: Mapping[str, Estimate]) -> str:
    """What comes closest to an unknown misfit, and why it is not named."""
    none = "no candidate effect explains the misfit."
    if judgment.closest is None:
        return f"{judgment.refutation}, and {none}" if judgment.refutation else none
    labels = " with ".join(effects[e].label for e in judgment.closest.effects)
    if judgment.refutation in (NO_GAIN, HELD_OUT_WORSE):
        verb = "are" if len(judgment.closest.effects) > 1 or is_plural(labels) else "is"
        return f"{labels} would explain it, but {verb} not named, since {judgment.refutation}."
    if judgment.beyond_range and (amount := amplitude_text(effects[judgment.closest.effects[0]], amplitudes)):
        return f"{none} {capitalized(labels)}{amount} would explain it."
    verb = "come" if len(judgment.closest.effects) > 1 or is_plural(labels) else "comes"
    why = judgment.refutation or "a significant residual remains"
    return f"{none} {capitalized(labels)} {verb} closest, but {why}."


def remainder_sentence(share: float, most_like: str = "") -> str:
    """The sentence on a significant residual: its share of the rms misfit, and what it resembles most."""
    size = "small " if share < SMALL_REMAINDER else ""
    percent = f"{100 * share:.0f}" if share >= 0.01 else f"{100 * share:.1g}"
    return f"A {size}significant residual remains ({percent} % of the rms misfit{most_like})."


def _immaterial(
    judgment: Judgment, effects: Mapping[str, Effect], amplitudes: Mapping[str, Estimate], size: Size | None
) -> str:
    """The sentence on a significant finding that does not matter: first its size, then a possible effect."""
    text = f"No model error that matters: a deviation is significant ({p_text(judgment.detection.p_value)}) but small"
    if judgment.immaterial is None and size is not None:
        return f"{text}: a free profile of the error changes the {_size(size, ' by only ')}."
    if judgment.immaterial is None:
        return f"{text}: even free profiles change the output and the parameters by less than what matters."
    named = " with ".join(_with_amplitude(effects[e], amplitudes) for e in judgment.immaterial.effects)
    verb = "come" if len(judgment.immaterial.effects) > 1 or is_plural(named) else "comes"
    what = "would explain it" if judgment.accepted else f"{verb} closest to it"
    of_size = f": {_size(size, ' ')}" if size else ""
    return f"{text}{of_size}. {capitalized(named)} {what}."


def _size(size: Size, between: str) -> str:
    """The size of a finding, with the text between the output and its change."""
    unit = f" {size.unit}" if size.unit else ""
    output = size.output.replace("_", " ")
    parts = [f"{output}{between}{size.change:.2g}{unit} rms (noise floor {size.noise_floor:.2g}{unit})"]
    if size.shifts_in_std:
        name, most = max(size.shifts_in_std.items(), key=lambda item: abs(item[1]))
        parts.append(f"parameters at most {two_digits(abs(most))} standard deviations ({name.replace('_', ' ')})")
    return ", ".join(parts)


def not_possible(why: str) -> str:
    """The sentence where these data allow no diagnosis."""
    return f"Diagnosis not possible: {why}."


def data_fault(fault: str) -> str:
    """The sentence where a sensor did not measure."""
    return f"Data fault: {fault}. Correct the sensor or exclude the segment, and run again."


def _ambiguous(judgment: Judgment, effects: Mapping[str, Effect], amplitudes: Mapping[str, Estimate]) -> str:
    """The sentence on several answers: the effects that they share, and the alternatives joined by "or"."""
    sets = interchangeable(judgment.answers)
    if len(judgment.answers[0].effects) == 1 or not sets:
        every = [" with ".join(_with_amplitude(effects[e], amplitudes) for e in t.effects) for t in judgment.answers]
        text = f"Unmodeled effect present ({p_text(judgment.detection.p_value)}): {_either(every)} would explain it"
        return f"{text}; these data cannot discriminate between them."
    parts = [_either([_with_amplitude(effects[e], amplitudes) for e in one]) for one in sets]
    text = f"{', and '.join(parts)}, explain {_share(judgment.gain)}"
    return f"{capitalized(text)}; these data cannot discriminate between the effects joined by 'or'."


def _either(named: Sequence[str]) -> str:
    shown = list(named[:SHOWN])
    if len(named) > SHOWN:
        shown.append(f"{len(named) - SHOWN} more")
    return listed(shown, "or")


def _share(gain: HeldOutGain | None) -> str:
    """The share of the rms error above the noise floor that is explained on held-out data."""
    if gain is None or not gain.better:
        return PART
    return f"{100 * gain.share:.0f} % of the rms error above the noise floor"


def _explained(judgment: Judgment) -> str:
    """What an answer explains: a share of the error, or only a contradiction to a stated value."""
    if judgment.contradicted is not None and (judgment.gain is None or not judgment.gain.better):
        what = f"the stated {judgment.contradicted.replace('_', ' ')}" if judgment.contradicted else "stated values"
        return f"why the model without it contradicts {what}"
    return _share(judgment.gain)


def is_plural(label: str) -> bool:
    """Whether a label such as "rear wheel loads that are logged late" is a plural.

    The noun is the last word before the first of ``AFTER_THE_NOUN``; mass, radius and axis are no plurals.
    """
    words = label.split()
    noun = words[next((i for i, word in enumerate(words) if word in AFTER_THE_NOUN), len(words)) - 1]
    return noun.endswith("s") and not noun.endswith(("ss", "us", "is"))


def _compensated(gain: HeldOutGain | None) -> str:
    """A note where the answer makes predictions with stated parameters worse; empty where it does not."""
    if gain is None or not (gain.prediction_worse or gain.refitted):
        return ""
    return (
        " With it, the error of predictions with the stated parameters increases: a stated parameter has an "
        "error that the effect had compensated."
    )


def _with_amplitude(effect: Effect, amplitudes: Mapping[str, Estimate]) -> str:
    return f"{effect.label}{amplitude_text(effect, amplitudes)}"


def amplitude_text(effect: Effect, amplitudes: Mapping[str, Estimate]) -> str:
    """The amplitude as text after the effect's label, " of 2.0 +- 0.1 m/s"; empty for several amplitudes.

    An interval that is not centered at the value is stated by its ends, " of 2.0 [1.9, 2.4] m/s": its half may suggest
    that it includes zero.
    """
    name = next(iter(effect.unknowns))
    if name not in amplitudes or len([n for n in effect.unknowns if n not in effect.nominal]) > 1:
        return ""
    e = amplitudes[name]
    percent = not e.unit and effect.unknowns[name].meaning.startswith("share")
    scale = 100.0 if percent else 1.0
    half = scale * e.half_width
    places = decimals(half, 12) if half > 0 else 3
    unit = f" {e.unit}" if e.unit else " %" if percent else ""
    sense = f" {effect.sense}" if effect.sense else ""
    low, high = (scale * end for end in e.interval95)
    off_center = abs(0.5 * (low + high) - scale * e.value) > OFF_CENTER * half
    spread = f"[{low:.{places}f}, {high:.{places}f}]" if off_center else f"+- {half:.{places}f}"
    text = f"{scale * e.value:.{places}f} {spread}{unit}{sense}"
    low, high = bounds_of(effect, name)
    beyond = not low <= e.value <= high
    text += ", beyond the plausible range" if beyond else ""
    in_brackets = beyond or (any(word in effect.label.split() for word in CLAUSE) and "(" not in text)
    axles = _of_axles(scale * e.value, amplitudes.get(f"{name}_balance"), places)
    if in_brackets:
        return f" ({text}{axles and f'; {axles}'})" + _factor_text(effect, e)
    return f" of {text}{axles and f' ({axles}{unit})'}" + _factor_text(effect, e)


def _of_axles(mean: float, balance: Estimate | None, places: int) -> str:
    """The amplitudes of the front and the rear axle, where they differ significantly; else empty.

    ``balance`` b is (front - rear)/(front + rear): 1 + b times the mean in front, 1 - b at the rear.
    """
    if balance is None or balance.interval95[0] <= 0.0 <= balance.interval95[1]:
        return ""
    front, rear = (mean * (1.0 + sign * balance.value) for sign in (1.0, -1.0))
    return f"front {front:.{places}f}, rear {rear:.{places}f}"


def _factor_text(effect: Effect, e: Estimate) -> str:
    """The factor of a scale that is far off, with the usual mistake that causes it; empty where it is not."""
    factor, half = 1.0 + e.value, e.half_width
    if not effect.mistakes or factor <= 0.0:
        return ""
    off = max(factor, 1.0 / factor)
    exact = max(half / factor, SAME_FACTOR)
    mistake = usual_mistake(factor, effect.mistakes, min(exact, UNLIKE_FACTOR))
    usual = f": {mistake}?" if mistake else ""
    if not usual and off < MANY_TIMES:
        return ""
    if effect.sensor:
        return f" (reads {off:.3g} times too {'high' if factor > 1.0 else 'low'}{usual})"
    return f" ({factor:.3g} times the stated value{usual})"
