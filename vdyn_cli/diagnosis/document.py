"""The ``diagnosis`` part of a result's JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vdyn_cli.diagnosis.detect import fewest_runs
from vdyn_cli.diagnosis.invisible import Invisible
from vdyn_cli.diagnosis.next_test import NextTest
from vdyn_cli.diagnosis.sizes import sizes_of
from vdyn_cli.diagnosis.verdict import Verdict
from vdyn_cli.diagnosis.words import interchangeable
from vdyn_cli.diagnosis.workbench import Workbench
from vdyn_cli.quantities.parameters import Estimate

RANKED = 8  # causes in the ranking
EXACT = 1e-3  # share of a trace that is left: less is imitated exactly
MOSTLY = 0.9  # share of a trace that is left: more is not worth a word


def document(
    bench: Workbench,
    verdict: Verdict,
    sentence: str,
    accepted: Sequence[str],
    sizes: Mapping[str, Estimate],
    biased: Mapping[str, Mapping[str, float]],
    where: Sequence[Mapping[str, Any]],
    tests: Sequence[NextTest],
    metric: tuple[str, str],
) -> dict[str, Any]:
    """Verdict, causes with sizes, what can't be told apart or shown, gain, where, ranking and next test.

    Parameters
    ----------
    accepted : causes that were taken into the model.
    sizes : of their unknowns, and of those of named causes that were not taken in.
    biased : without less with each accepted cause, by published parameter.
    metric : name and unit of what the gain is measured in.
    """
    found = verdict.detection
    return {
        "verdict": verdict.name,
        "sentence": sentence,
        "p_value": found.p_value,
        "evidence": {
            "unit": found.unit,
            "units": found.units,
            "stated": found.stated,
            "worth": found.worth,
            "smallest_p": found.smallest,
        },
        "causes": [_cause(bench, verdict, c, sizes, biased.get(c, {})) for c in _causes(verdict, accepted)],
        "extended": list(accepted),
        "ambiguous": _ambiguous(verdict),
        "not_testable": [
            {
                "effect": one.effect,
                "because": _because(bench, one),
                "size": one.size,
                "unit": bench.case.causes[one.effect].unknowns[bench.unknowns(one.effect)[0]].unit,
                "would_bias": one.would_bias,
            }
            for one in verdict.invisible
        ],
        "gain": _gain(verdict, metric),
        "where": list(where),
        "ranking": _ranking(bench, verdict),
        "next_test": [
            {"manoeuvre": t.manoeuvre, "separates": list(t.separates), "expected_t": t.expected_t, "runs": t.runs}
            for t in tests
        ],
    }


def not_diagnosed(why: str, fault: str = "") -> dict[str, Any]:
    """The same keys where no diagnosis could be made; ``fault``: a sensor that did not measure, if there is one."""
    text = f"These data can't tell what the simulation gets wrong: the diagnosis could not be made ({why})."
    if fault:
        text = f"The data are at fault: {fault}. Leave that part out, then look again."
    return {
        "verdict": "data_fault" if fault else "not_testable",
        "sentence": text,
        "p_value": None,
        "evidence": None,
        "gain": None,
        "doubt": "",
        "not_extended": "",
        **{k: [] for k in ("causes", "extended", "ambiguous", "not_testable", "where", "ranking", "next_test")},
    }


def _causes(verdict: Verdict, accepted: Sequence[str]) -> list[str]:
    return list(dict.fromkeys([*_named(verdict), *accepted]))


def _named(verdict: Verdict) -> tuple[str, ...]:
    return verdict.answer.causes if verdict.answer else ()


def _cause(
    bench: Workbench, verdict: Verdict, cause: str, sizes: Mapping[str, Estimate], biased: Mapping[str, float]
) -> dict[str, Any]:
    scores = verdict.detection.scores
    effect = bench.case.causes[cause]
    return {
        "effect": cause,
        "label": effect.label,
        "unknowns": _unknowns({n: sizes[n] for n in effect.unknowns if n in sizes}),
        "p_value": verdict.detection.p_value if cause in _named(verdict) else None,
        "visibility": scores.visibility[cause],
        "sensor": effect.sensor,
        "lasts": effect.lasts,
        "biased": dict(biased),
    }


def _unknowns(sizes: Mapping[str, Estimate]) -> dict[str, Any]:
    return {
        n: {"value": e.value, "std": e.std, "interval95": list(e.interval95), "unit": e.unit} for n, e in sizes.items()
    }


def _ambiguous(verdict: Verdict) -> list[list[str]]:
    """One cause out of each set makes the answer; a set of one is a cause that every answer has."""
    if verdict.name != "ambiguous":
        return []
    if sets := interchangeable(verdict.answers):
        return sets
    return [["+".join(t.causes) for t in verdict.answers]]


def _because(bench: Workbench, one: Invisible) -> str:
    run, own = bench.case.repeated, f"only {100 * one.visibility:.2g} % of its trace is its own"
    if one.because == "runs":
        fewest, runs = fewest_runs(bench.case.level), len(bench.full.runs)
        return f"it differs from {run} to {run}, of which {runs} are too few to certify it (at least {fewest})"
    if one.because == "imitated":
        return f"the parameters that are fitted anyway imitate it{f': {own}' if one.visibility > EXACT else ' exactly'}"
    return f"{own}, and the noise hides that" if one.visibility < MOSTLY else "at any plausible size the noise hides it"


def _gain(verdict: Verdict, metric: tuple[str, str]) -> dict[str, Any] | None:
    found = verdict.gain
    if found is None:
        return None
    name, unit = metric if found.plain else ("error over its noise", "")
    return {
        "metric": f"{name} rms",
        "unit": unit,
        "before": found.before,
        "after": found.after,
        "interval95": list(found.interval),
        "share_of_explainable": found.share,
        "certain": found.better,
        "held_out": True,
        "folds": found.folds,
    }


def _ranking(bench: Workbench, verdict: Verdict) -> list[dict[str, Any]]:
    """Causes by what they explain alone, as a normal deviate whatever their unknowns, and what each leaves; of those
    that were tried as the whole answer, the sizes that they then had."""
    scores = verdict.detection.scores
    rest = {t.causes[0]: t for t in verdict.tried if len(t.causes) == 1}
    names = sorted(verdict.detection.testable, key=lambda n: -scores.evidence[n])[:RANKED]
    return [
        {
            "effect": n,
            "explains_t": max(scores.evidence[n], 0.0),
            "visibility": scores.visibility[n],
            "left_p": rest[n].rest if n in rest else None,
            "left_mostly": rest[n].strongest if n in rest else None,
            "unknowns": _unknowns(sizes_of(rest[n], bench.case)) if n in rest else {},
        }
        for n in names
    ]
