"""Every threshold of parts at fault and of learned laws, with its reason; part of ``POLICY``."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PartPolicy:
    """The thresholds of parts at fault and of learned laws."""

    part_near: float = 0.7
    """[share of the strongest evidence] above which another element, or one place of it, is refitted as well. On
    linearizations about the baseline, wrong elements reached at most 70 % of the evidence of the right one; set by
    tests/bench/other_laws.md. Of two places at fault each explains about half; a single one explains nearly all."""

    rival_share: float = 0.02
    """[share of the evidence] by which a part must exceed another to rule it out as a rival. Evidence of hundreds of
    standard errors is not exact to 2 %, because laws and linearization are not."""

    most_elements: int = 2
    """[elements] that are refitted, at most. A bound of the cost: a refit takes a dozen simulations with the
    sensitivities of one part."""

    part_squares: float = 0.8
    """[share of the explainable squares] that a part must explain to be at fault, and a learned law to be named. All
    parts and candidates together also explain some of the noise; where a part leaves more than a fifth, another fault
    is present. Set by tests/bench/other_laws.md."""

    covered_share: float = 0.5
    """[share of the prior's band] below which a curve's band counts as determined by the data. Where the data halve the
    band of the prior, they hold three times its information."""

    fewest_curve_degrees: float = 4.0
    """[degrees of freedom] of a curve's band, at least. Few blocks determine a point of a curve, but the smoothness
    prior joins it to its neighbors."""

    law_share: float = 0.85
    """[share of the curve's rms deviation] that a law of the catalog must explain to be named for a part. Laws within a
    tenth of the true one are to be named; the rest allows for the error of the curve and for the law being fitted to
    the data instead of the curve."""

    law_squares: float = 0.5
    """[share of the squares that the part explains] that a law of the catalog must also explain in the data. A law can
    follow the curve and still fail where most of the samples are, such as friction near rest. A law that leaves more
    than half of the misfit is not the right one."""

    formula_share: float = 0.95
    """[share of the curve's rms deviation] that a formula must explain to replace the free curve. The remainder is
    below the error with which laws of elements are known, a few percent."""

    formula_level: float = 0.99
    """[probability] of the chi-square distance from the free curve, up to which a formula is not rejected. A true
    formula is rejected in one of a hundred cases; the table then contains it as well."""

    learned_information: float = 3.0
    """[times the prior's] information that the data must have about a shape for a learned table to keep it. As
    covered_share: shapes that only the smoothness prior determines are left out of the table."""
