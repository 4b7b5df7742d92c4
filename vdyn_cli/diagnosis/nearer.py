"""Straight lines nearer to the car as it drove, where straight lines have to do."""

from __future__ import annotations

from vdyn_cli.diagnosis.detect import Detection, detect
from vdyn_cli.diagnosis.workbench import Workbench

LARGE = 6.0  # standard errors of a cause, from which a straight line's bend may count
NEARER = 8  # causes that are looked at each on its own lines


def nearer(bench: Workbench, found: Detection) -> tuple[Workbench, Detection]:
    """Where straight lines have to do, those through the car as it drove, and what is seen on them.

    What was seen from afar does not tell what is worth trying: of another relaxation of the tires a tenth of what it
    then seems to be of the half-shafts' damping, which on lines through it is nothing.
    """
    likeliest = _likeliest(bench, found)
    if likeliest is None or not bench.case.straight:
        return bench, found
    about = bench.about(likeliest) if found.scores.evidence[likeliest] > LARGE else bench
    beyond = bench.beyond(likeliest, about)
    base = beyond.fitted(())
    return (bench, found) if beyond is bench or base is None else (beyond, detect(beyond, base))


def _likeliest(bench: Workbench, found: Detection) -> str | None:
    """The cause that explains most, of large ones each on lines through itself: from afar a wrong one may seem more.

    Several times more: another damping of the half-shafts for whatever makes them swing in another time.
    """
    evidence = found.scores.evidence
    large = sorted((n for n in found.testable if evidence[n] > LARGE), key=lambda n: -evidence[n])[:NEARER]
    if not bench.case.straight or len(large) < 2:
        return found.scores.strongest(found.testable)
    far = {n: bench.fitted((n,)) for n in large}
    near = {n: bench.near(fitted).solution.cost for n, fitted in far.items() if fitted is not None}
    return min(near, key=lambda n: near[n], default=found.scores.strongest(large))
