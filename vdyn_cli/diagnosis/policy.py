"""Every threshold that can change a verdict, an amplitude or a p value of a diagnosis, each with its reason."""

from __future__ import annotations

from dataclasses import dataclass

from vdyn_cli.diagnosis.part.part_policy import PartPolicy
from vdyn_cli.diagnosis.strategies.fit_policy import FitPolicy
from vdyn_cli.quantities.result import MISFIT


@dataclass(frozen=True)
class Policy(PartPolicy, FitPolicy):
    """The thresholds of the diagnosis. ``vdyn explain policy`` prints each with unit, meaning and reason.

    Standard errors are those of the score test, blocks are the independent units within runs. "Evidence" is the normal
    deviate that is as rare as the score statistic with its degrees of freedom.
    """

    # Detection ------------------------------------------------------------------------------------------------------
    level: float = 0.05
    """[probability] false-alarm level of one command; a pipeline shares it over its diagnosed steps. The conventional
    5 %. Bonferroni over the steps of a pipeline: it also holds for steps that share data."""

    named_share: float = 0.4
    """[share of the level] spent on effects that vary within runs, and as much on those between runs. Bonferroni over
    three families of tests, 0.02/0.02/0.01 of 0.05: the two families of named effects have equal shares."""

    profile_share: float = 0.2
    """[share of the level] spent on free profiles. Half a family's share: profiles have many unknowns and serve as an
    omnibus test, not as an answer."""

    smallest_p_ratio: float = 3.0
    """by which the smallest attainable p value must lie below the level. A family's share multiplies its p value by
    1/0.4 = 2.5: with a larger smallest p value the test never rejects. Rounded up."""

    scaled_share: float = 0.1
    """[share of a family] spent on statistics scaled by their own sign-flip mean. Where the baseline's error is many
    times the noise, sign flips of one large sensitivity hide the others. A tenth costs the plain test 10 % of its
    level; tests/diagnosis/test_scores.py measures level and power."""

    enumerated_units: int = 13
    """[units] up to which all sign patterns are tried, without random draws. 2^12 = 4096 patterns cost as much as two
    sets of random draws; beyond, their number doubles with each unit."""

    sign_draws: int = 1999
    """[draws] of random signs, where patterns are not enumerated. The smallest p is 1/2000, below a third of the level
    of one step in ten (0.005/3); the standard error of p = 0.05 is 0.005."""

    fewest_runs_between: int = 8
    """[runs] needed to test effects that vary between runs. n runs have 2^(n-1) sign patterns up to a common sign: six
    reach p = 2^-5 = 0.031, seven 0.016, eight 0.008. The family's share is 0.4 * 0.05 = 0.02; the smallest p must be a
    third of that (smallest_p_ratio): eight."""

    fewest_units: int = 12
    """[blocks] below which no effect is certified. n blocks have 2^(n-1) sign patterns: with 12 the smallest p is
    0.0005. A step of a pipeline of ten has the level 0.005, a family 0.4 of it, and the smallest p must be a third of
    that, 0.0007: eleven cannot reject."""

    fewest_effective_units: float = 6.0
    """[blocks] effective number (sum I)^2 / sum I^2, below which no effect is certified. With an effective number of 6,
    no block holds more than 1/sqrt(6) = 41 % of the information: below, a single block may hold half of it and decide
    the test alone."""

    runs_as_units: int = 16
    """[runs] or more: the independent units are whole runs, not blocks. Runs have independent noise, so they are
    preferred. From 16 on Student's t(15) = 2.13 is within 9 % of the normal quantile 1.96: less than a tenth of the
    power is lost. With eight, t(7) = 2.36 loses a fifth."""

    # Testable or not ------------------------------------------------------------------------------------------------
    least_visibility: float = 0.02
    """[share of the sensitivity] that refitting the baseline must leave, for an effect to be testable. Laws of elements
    are known to a few percent: below that, the remainder is the error of the law itself. Set by the rows 'not testable'
    of the hidden-effect matrix, tests/bench/hidden.md."""

    prior_information: float = 0.5
    """[share of the information] from priors, above which an effect is testable at any visibility. With more than half,
    the effect contradicts what is known beforehand, such as the zero offset of a data sheet, so that its collinearity
    with fitted parameters does not matter."""

    contradiction: float = 2.0
    """[standard deviations] by which the data must contradict a stated value for the sentence to name it. 1 of 20
    correct values is as far off. It changes the sentence only."""

    reachable_t: float = 3.0
    """[standard errors] that an effect at the edge of its plausible range must reach to be testable. Below, even the
    largest plausible effect is not significant at 0.3 % (two-sided normal)."""

    typical_share: float = 0.5
    """[share of the plausible range] assumed amplitude of an effect without an estimate. The middle between zero and
    the largest plausible amplitude; reports state it wherever it is used."""

    revealing_power: float = 0.9
    """[probability] of detecting the smallest amplitude that is reported as detectable. The usual power of a planned
    trial (Cohen, Statistical Power Analysis, 1988, has 0.8 at least)."""

    # Naming ---------------------------------------------------------------------------------------------------------
    rest_level: float = 0.02
    """[probability] above which the residual of a candidate model counts as noise. The share of one family of tests in
    the default level: 0.4 * 0.05."""

    needed_t: float = 3.0
    """[standard errors] of each effect beside the others, or root of 2 d(log likelihood), at least. Chance exceeds it
    in 0.27 % (two-sided): with the 20 to 30 candidates of a step in 5 to 8 %, and only where a model error was detected
    at 5 % before."""

    negligible_rest: float = 0.1
    """[share of the rms misfit] that may remain significant beside a large effect, in the same part. Two laws of one
    element that differ by 10 % rms are the same effect (dry friction as a step or as tanh over 5 mm/s, a damper's
    knee): published curves of one part scatter as much. If a law of another part explained this share, that part would
    cause a tenth of the misfit: hence 'in the same part'."""

    exact_rest: float = 0.032
    """[share of the rms misfit] that may remain significant beside a large effect, in another part. A thousandth of the
    sum of squares, the error of a linearization about the fitted amplitude: tests/bench/hidden.md, rows 'usual' of
    bump. It shows only beside effects of a hundred standard errors."""

    rest_ratio: float = 1.75
    """between the rms residuals of two answers, above which the larger is no answer. The residual is a law's error of
    unknown size over the eight knots of a free profile. The likelihood ratio is then (larger / smaller)^8, and 1.75^8 =
    88 = exp(3^2 / 2): three standard errors, as needed_t."""

    excluding_amplitude: float = 6.0
    """[standard errors] that the amplitude of each of several answers, or the evidence of a free profile, must reach to
    exclude the baseline, and each effect's amplitude, for a further one to be added to an answer that suffices. Twelve
    blocks, the fewest, leave 11 degrees of freedom: Student's t exceeds 6 in 1e-4, and the strongest of 30 candidates
    does in 0.3 %, as with needed_t."""

    open_probability: float = 0.05
    """[probability] of one further effect beside a named one, above which intervals include that answer. The
    probability outside a 95 % interval: an answer that is likelier than that must not lie outside."""

    idle_noise: float = 1.0
    """[standard deviations] of the noise: an answer that changes every channel by less is dropped in favor of a
    logger's latency, if it does not matter for the main output either. A change below the noise of a sample is not
    visible in it. Slip that was named in place of a delay reaches 0.24, a wrong zero of an accelerometer 7."""

    matters_share: float = 0.1
    """[share] of a parameter's half interval, or of the output's noise floor: smaller changes do not matter. Errors add
    in squares: a tenth widens a total error by 0.5 %, which no published digit shows. 'diagnose: {matters: ...}' states
    other limits."""

    unexplained_share: float = 0.3
    """[share of the prediction's standard deviation] by which an unexplained residual must change predictions. Errors
    add in squares: 0.3 widens the total error of a prediction by 5 %. An unknown effect cannot be corrected: with a
    tenth (matters_share) as the limit it would be reported without a remedy."""

    single_evidence: float = 1.5
    """[standard errors] of evidence that a candidate needs to be tried alone. Chance exceeds it in 7 %; a weaker
    candidate cannot explain a misfit that is significant at 5 %."""

    single_share: float = 0.25
    """[share of the strongest evidence] that a candidate needs to be tried alone. Evidence is about the root of the
    likelihood gain: below a quarter, a sixteenth of the misfit is explained."""

    pair_evidence: float = 2.0
    """[standard errors] of evidence, alone or beside another effect, needed to be tried in a pair or a fold. 2.3 %
    exceed it by chance, less than one of the 20 to 30 candidates of a step. It is below needed_t since the misfit by a
    missing partner is part of the residual."""

    pair_pool: int = 10
    """[effects] with the largest evidence, from which pairs are formed. A bound of the cost: 45 pairs are compared to
    first order. The rows 'both' of tests/bench/hidden.md show what is missed."""

    pairs_refitted: int = 8
    """[pairs] refitted: the best to first order. A bound of the cost: each is a fit of a second or more. Seven causes
    of a lack of power are alike in a drive (torque gain, wheel radius, driveline loss, rotating mass, mass, payload,
    speed scale); a set of them beside another effect must be complete. Pairs that only a refit would show to be better
    are missed; the rows 'both' of tests/bench/hidden.md show how often."""

    most_effects: int = 5
    """[effects] in one answer by forward selection, at most. Real trips have up to four (tests/bench/bmw_diagnosis.md);
    five leaves a margin of one. A bound of the cost: the answer must be sufficient, and each effect needed, however
    many there are."""

    one_sided_share: float = 0.15
    """[share of the range] on the other side of zero, below which the effect has one sign only. Ranges of effects with
    one sign extend 2 to 13 % beyond zero, for the noise of the estimate (bearing_drag, friction_fade,
    load_sensitivity); those of effects with two signs a third and more (progressive_spring). The threshold lies in that
    gap of the catalog and is no statistical level."""

    simple_unknowns: int = 3
    """[unknowns] up to which an effect is a law; with more it is a profile. Laws have an amplitude and at most two
    shape parameters; profiles have eight unknowns and more."""

    imitation_level: float = 0.002
    """[probability] below which a profile beats a law by more than its additional unknowns explain. A tenth of
    rest_level: a profile can imitate every simpler law, so that it must be clearly better."""

    named_t: float = 2.0
    """[standard errors] across blocks or runs, by which the amplitude of a named effect must differ from zero. The
    bound of a 95 % interval: an effect whose interval contains zero is not named."""

    clearly_better: float = 4.5
    """[log likelihood] by which backlash must exceed effects collinear with it, and a part at fault others. needed_t^2
    / 2: a likelihood ratio of 90, which collinear laws reach by chance in 0.3 % (chi-square with one degree of freedom
    above 9)."""

    # Held-out gain --------------------------------------------------------------------------------------------------
    fewest_runs_left_out: int = 4
    """[runs] or more are left out one by one; fewer are cut into blocks. The interval has folds - 1 degrees of freedom:
    t(3) = 3.2 is the last useful one, t(2) = 4.3."""

    fewest_predicted_runs: int = 3
    """[runs] or more are left out one by one where parameters keep their prior values. Only amplitudes are fitted, and
    the noise model adds noise_model_folds to the degrees of freedom."""

    fewest_blocks_left_out: int = 8
    """[blocks] below which no gain is stated. With seven degrees of freedom, t = 2.4 is within a fifth of the normal
    quantile; neighboring blocks of one run are less independent than runs, so more of them are required."""

    noise_model_folds: int = 4
    """[folds] to which the variance by the noise model is equivalent. Scatter and noise model have equal weight at five
    folds, the usual number of drives in a test. tests/diagnosis/test_held_out_gain.py measures the coverage."""

    prediction_exactness: float = 1e-3
    """[share of the error] least half-width of the gain's interval, and least gain in a channel that changes.
    Simulations and laws are no more exact, even where the folds agree better."""

    compensating_effects: int = 2
    """[effects] up to which a named answer may increase the error of predictions with stated parameters, or explain
    less than one part of the model does. One effect and one wrong parameter can compensate each other; three and more
    that all do are not credible."""

    misfit: float = MISFIT
    """[rms over noise floor] above which a residual is a model error without a significant test. Third differences,
    which give the noise floor, show 1/2.0 of the noise of a mean over two samples, and 1/2.2 of one over three, as
    loggers write them; rounded up."""

    # Next test ------------------------------------------------------------------------------------------------------
    separated_t: float = 6.0
    """[standard errors] of separation that a planned test must reach. Power: an estimate of t = 6 exceeds 3.5 standard
    errors, the two-sided level 0.02 / 40 candidates, in 99.4 %, and needed_t in 99.9 %."""


POLICY = Policy()


def shared_level(steps: int) -> float:
    """The level of each of several diagnosed steps that together keep POLICY.level: level / steps (Bonferroni).

    Rounded to four digits, so that ``--level`` can state it.
    """
    return float(f"{POLICY.level / max(steps, 1):.4g}")
