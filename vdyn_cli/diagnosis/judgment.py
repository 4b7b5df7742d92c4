"""The evidence that a diagnosis gathers, and the verdict that follows from it, one of six.

``Judgment.verdict`` takes these decisions in this order:

not_testable  too few data, no candidate would be visible, or all runs have the direction that imitates the effect
data_fault    a sensor did not measure
adequate      no model error is significant, or none that matters
unknown       no candidate model is accepted, or the one that was is refuted: by its amplitude or by held-out runs
ambiguous     several are accepted; these data cannot discriminate between them
named         one effect (or one set of effects) is accepted; data_fault if it is a sensor error other than a latency

``diagnose`` gathers the evidence in four stages, none of which sets a verdict: ``judge`` (candidate_judgment) tries the
candidate effects, ``with_part`` (part_judgment) the laws of the part at fault, ``with_nuisance_effects`` the sensor
errors that the baseline contains, such as the latency of a logger, and ``extended`` (extension) the step's exact model,
which replaces or refutes an answer that it does not confirm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from vdyn_cli.diagnosis.detect.detection import Detection
from vdyn_cli.diagnosis.gain.held_out_gain import HeldOutGain
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel, best_fit
from vdyn_cli.diagnosis.size.finding_size import FindingSize
from vdyn_cli.diagnosis.strategies.full_model import FittedModel
from vdyn_cli.quantities.diagnosis import NotTestable, Verdict

NONE_VISIBLE = "no candidate effect would be visible in these data"
HELD_OUT_WORSE = "the held-out error increases"
NO_GAIN = "the held-out error does not decrease"
NOT_SIGNIFICANT = "its amplitude is not significantly different from zero across blocks"
BEYOND_RANGE = "its amplitude is beyond the plausible range"
IMITATED = "a free profile with fewer unknowns fits equally well"


@dataclass(frozen=True)
class NuisanceError:
    """A sensor error that the baseline contains as a nuisance parameter, and that is significant.

    Parameters
    ----------
    model : the candidate model with the error as its last effect.
    expected : the largest size that every logger may have; 0 where the error does not matter.
    """

    model: CandidateModel
    expected: float = 0.0


@dataclass(frozen=True)
class Judgment:
    """The evidence, and the verdict that follows.

    Parameters
    ----------
    base, detection : the fit of the baseline, and the tests beside it.
    untestable : candidates that these data cannot show.
    insufficient : why these data allow no diagnosis. fault : the sensor that did not measure. Empty where neither is.
    one_way : why the effects found, or their absence, are confounded with others: all runs have one direction.
    tried : all single effects and sets that were tried.
    accepted : those that suffice and that nothing refutes. closest : without such, the one that explains most, if any.
    refutation : why ``closest`` is no answer although it would suffice.
    material : whether the finding matters; None where no model error is significant.
    size : size of the finding: of the answer, of the first of several, or of ``closest``.
    gain : held-out gain of the answer.
    contradicted : where most of the evidence for the answer is a contradiction between the baseline and stated values,
        such as a drawing or a sensor zero: the one that it contradicts most, empty for several. The answer then need
        not improve the prediction of an output. Else None.
    nuisance : a sensor error in the baseline that does not matter, or is expected.
    """

    base: FittedModel
    detection: Detection
    untestable: tuple[NotTestable, ...] = ()
    insufficient: str = ""
    fault: str = ""
    one_way: str = ""
    tried: tuple[CandidateModel, ...] = ()
    accepted: tuple[CandidateModel, ...] = ()
    closest: CandidateModel | None = None
    refutation: str = ""
    material: bool | None = None
    size: FindingSize | None = None
    gain: HeldOutGain | None = None
    contradicted: str | None = None
    nuisance: NuisanceError | None = None

    @property
    def verdict(self) -> Verdict:
        """The verdict that follows from the evidence; the first lines of this module list the decisions."""
        if self.insufficient or self.one_way:
            return "not_testable"
        if self.fault:
            return "data_fault"
        if not self.material:
            return "adequate"
        if not self.accepted:
            return "unknown"
        if len(self.accepted) > 1:
            return "ambiguous"
        return "data_fault" if self.accepted[0].sensor_fault else "named"

    @property
    def answers(self) -> tuple[CandidateModel, ...]:
        """The accepted models by which the verdict explains the misfit: one if named, several if ambiguous."""
        explained = self.material and not (self.insufficient or self.one_way or self.fault)
        return self.accepted if explained else ()

    @property
    def answer(self) -> CandidateModel | None:
        """The one answer, where there is one."""
        return self.answers[0] if len(self.answers) == 1 else None

    @property
    def confounded(self) -> tuple[CandidateModel, ...]:
        """The accepted models that are confounded with others in runs of one direction."""
        return self.accepted if self.one_way and self.material else ()

    @property
    def immaterial(self) -> CandidateModel | None:
        """The model that explains a significant finding that does not matter, or comes closest to it."""
        if self.material is not False:
            return None
        return self.accepted[0] if self.accepted else self.closest

    @property
    def beyond_range(self) -> CandidateModel | None:
        """The effect that would suffice if its amplitude were plausible; None where there is no such effect."""
        return self.closest if self.verdict == "unknown" and self.refutation == BEYOND_RANGE else None

    @property
    def possible(self) -> tuple[CandidateModel, ...]:
        """The answers, or the effect beyond its plausible range where there are none."""
        return self.answers or ((self.beyond_range,) if self.beyond_range else ())

    def refuted(self, why: str = "", closest: CandidateModel | None = None) -> Judgment:
        """The judgment without an answer, because of ``why``.

        ``closest`` is the best of the former answers by default.
        """
        return replace(self, refutation=why, accepted=(), gain=None, closest=closest or best_fit(self.answers))

    def naming(self, answer: CandidateModel, gain: HeldOutGain | None) -> Judgment:
        """The judgment whose only answer is this one, with its held-out gain."""
        return replace(self, accepted=(answer,), refutation="", closest=None, gain=gain)
