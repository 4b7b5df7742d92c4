"""`vdyn explain glossary`: the terms of this project that a reader of its reports needs, one line each."""

from __future__ import annotations

GLOSSARY = {
    "candidate effect": "a law or sensor fault that may be missing from the model; no influence at zero amplitude",
    "effect": "a candidate effect that the diagnosis names or the description requests; see 'vdyn list'",
    "baseline": "the model, and its estimates, before any effect is added",
    "extension": "the model with effects added; its estimates are reported beside those of the baseline",
    "diagnosis": "test of the baseline against all candidate effects, after each fit",
    "verdict": "conclusion of the diagnosis, one of the next six",
    "adequate": "no model error detected",
    "named": "one effect, or up to five together, remove the significant residual, and every rival is rejected",
    "ambiguous": "several effects remove the residual about equally well; the set is listed",
    "unknown": "a significant model error that no candidate effect removes",
    "not_testable": "no test is possible: too few or too short runs, no visible candidate effect, or a failed fit",
    "data_fault": "the named effect is that of a sensor (other than a latency), or a sensor failed",
    "evidence": "the independent units that the test compares, and their effective number",
    "run": "one pass over the track, or one recording: the largest independent unit",
    "block": "a part of a run, long enough to be nearly independent of its neighbors",
    "level": "chance of a false alarm when the model is correct, over all candidate effects",
    "score test": "test of a candidate effect from the baseline's residual, in standard errors",
    "amplitude": "the estimate of an effect's unknown, such as a headwind of 2 m/s",
    "visibility": "share of an effect's sensitivity that is not collinear with the fitted parameters, 0 to 1",
    "not testable effect": "a candidate effect that these data cannot show, with the bias it would cause",
    "bias": "error of a parameter while the model lacks the effect",
    "remainder": "significant residual that remains with the named effects",
    "free profile": "a smooth curve over speed, time or position, a substitute for any law that is not listed",
    "held-out gain": "decrease of the error in runs that neither the fit nor the choice of effect used",
    "noise floor": "rms of the residual that measurement noise alone would leave",
    "given": "a value that the description states, with the standard deviation after +-",
    "prior": "a given value with its standard deviation, where the data may change it",
    "pull": "change of a given value by the fit, in standard deviations of that change",
    "next test": "the manoeuvre that separates rival effects, with the expected distance in standard errors",
    "refused": "why a result is not published: report and JSON then contain the diagnosis, but no parameters",
    "withheld": "a parameter that is not published because the data do not determine it, with the reason",
    "finding": "one message: place, fact, number, remedy",
    "doubt": "a finding that makes the result doubtful; listed first",
    "known": "parameters of other steps, passed with --known",
}


def glossary() -> str:
    """The glossary as text, one line each: word and meaning."""
    width = max(map(len, GLOSSARY))
    return "\n".join(f"{word:<{width}}  {meaning}" for word, meaning in GLOSSARY.items())
