"""Check of a test's runs before the car leaves the track, without estimate or diagnosis."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from vdyn_cli.description.yaml_source import load_yaml
from vdyn_cli.io.file_units import wrong_units
from vdyn_cli.io.quality.clock_gaps import clock_gaps
from vdyn_cli.io.quality.cuts import TESTS, CutLog
from vdyn_cli.project.checks.campaign import balance_of_kept, track_check
from vdyn_cli.project.checks.check_policy import CHECK
from vdyn_cli.project.checks.description_checks import refuse_pipeline
from vdyn_cli.project.checks.exact_values import implausible_rotating_mass
from vdyn_cli.project.checks.redundancy import compared_over_runs, tied_pairs, untied_channels
from vdyn_cli.project.inputs import Inputs, errors_of_step, gather_usable
from vdyn_cli.project.reading.left_out_runs import LeftOutRun
from vdyn_cli.project.reading.run_reading import tilts_with_body
from vdyn_cli.quantities.check_schema import (
    CheckDocument,
    CheckedRun,
    CheckFlag,
    CoastBalance,
    Decision,
    RunVerdict,
    TiedPair,
)
from vdyn_cli.quantities.cut_ledger import LedgerRow
from vdyn_cli.quantities.errors import Finding, InputError, ResultError, VdynError, did_you_mean, merge_similar
from vdyn_cli.quantities.number_text import moment
from vdyn_cli.quantities.quality_flags import EVERY, Flag
from vdyn_cli.quantities.result_schema import FindingEntry
from vdyn_cli.steps import Step, load_step, names
from vdyn_cli.steps.step_definition import TrackCheck, named_channels

_FEWEST_STEPS = 50  # of a clock that is sampled; a table of split times has fewer
Segment = tuple[float, float, int, str]  # first and last time (s), samples, the fact


def step_of(path: Path) -> Step:
    """The step of a description.

    Raises
    ------
    InputError : the file cannot be read, or its key ``test`` is not the name of a step.
    """
    source = load_yaml(path)
    refuse_pipeline(source)
    test = source.data.get("test") if isinstance(source.data, dict) else None
    if test not in names():
        known = ", ".join(names())
        remedy = did_you_mean(str(test), names(), f"write 'test:' and one of {known}")
        what = "the key 'test' is missing" if test is None else f"{str(test)!r} is not a step"
        raise InputError(Finding(source.where(("test",)), what, remedy=remedy))
    return load_step(str(test))


def check(path: Path, known_files: Iterable[Path] = ()) -> tuple[CheckDocument, Inputs]:
    """Check the runs of a test description; also return the inputs, for the figures of the page.

    Parameters
    ----------
    path : the description. known_files : parameter files.

    Raises
    ------
    InputError : the description or a log is wrong, as for the step itself, or there is no log.
    """
    inputs = gather_usable(step_of(path), path, known_files)
    if not inputs.unsplit:
        what = "the description has no runs: there is no log to check"
        remedy = f"list each log under 'runs'; a test without logs needs no check: run 'vdyn {inputs.step.name}'"
        raise InputError(Finding(str(path), what, remedy=remedy))
    lacking = tuple(replace(f, doubt=True) for run in inputs.left_out for f in run.problems)
    try:
        found = track_check(inputs)
        refused = _refused(inputs, found.rejected)
    except InputError as error:
        raise type(error)(*lacking, *error.findings) from None
    contradicted = (*found.contradicted, *inputs.contradicted)
    wrong = _corrections(inputs, refused, contradicted)
    computed = [(one.channel.source, one.channel.target) for one in inputs.scalings]
    tilts = tilts_with_body(inputs.spec)
    tied = [p for one in inputs.unsplit for p in tied_pairs(one.log, inputs.known, computed, inputs.clocks, tilts)]
    redundancy, contradictions = compared_over_runs(tied)
    vehicle = implausible_rotating_mass(inputs)
    runs = [_checked(inputs, k, found, refused, redundancy) for k in range(len(inputs.unsplit))]
    if wrong:
        runs = [_until_corrected(inputs, k, run, contradicted) for k, run in enumerate(runs)]
    coasts, runs = balance_of_kept(inputs, found.coasts, runs), _with_left_out(runs, inputs.left_out)
    document = CheckDocument(
        format="vdyn/check/1",
        step=inputs.step.name,
        title=inputs.spec.title,
        good=all(r.verdict == "keep" for r in runs) and not vehicle,
        sentence=_correct_first(inputs, wrong, runs) if wrong else _sentence(runs, coasts, vehicle),
        runs=runs,
        flags=[flag for one in inputs.unsplit for flag in _flags(one)],
        redundancy=redundancy,
        untied=untied_channels([one.whole for one in inputs.unsplit], redundancy),
        clocks=list(inputs.clocks),
        coasts=coasts,
        parameters="not evaluated",
        findings=[
            FindingEntry(**f.to_json())
            for f in merge_similar(
                [
                    *lacking,
                    *refused.findings,
                    *contradicted,
                    *found.findings,
                    *contradictions,
                    *vehicle,
                    *inputs.findings,
                    *(f for one in inputs.unsplit for f in one.log.findings),
                ]
            )
        ],
    )
    return document, inputs


def _with_left_out(runs: Sequence[CheckedRun], left_out: Sequence[LeftOutRun]) -> list[CheckedRun]:
    """The runs in the order of the description, with those that could not be judged."""
    every = list(runs)
    for one in left_out:
        why = [_text(f) if f.where in (one.name, "") else f"{f.where}: {_text(f)}" for f in one.problems]
        log, verdict = one.log, "unreadable" if one.log is None else "wrong"
        size = {"duration": 0.0, "samples": 0} if log is None else {"duration": log.duration, "samples": log.time.size}
        every.insert(one.index, CheckedRun(run=one.name, verdict=verdict, why=why, lost=1.0, **size))
    return every


def _corrections(inputs: Inputs, refused: VdynError, contradicted: Sequence[Finding]) -> tuple[str, ...]:
    """What is wrong in the description, each with its remedy; until it is corrected, the runs cannot be judged."""
    units = merge_similar(wrong_units(f for one in inputs.unsplit for f in one.log.findings))
    others = [f for f in refused.findings if isinstance(refused, InputError)]
    return (
        *(f"{f.what}; {f.remedy}" for f in units),
        *(f"vdyn {inputs.step.name} refuses {f.where}: {_text(f)}; {f.remedy}" for f in merge_similar(others)),
        *(f"{f.where}: {_text(f)}; {f.remedy}" for f in contradicted),
    )


def _correct_first(inputs: Inputs, wrong: Sequence[str], runs: Sequence[CheckedRun]) -> str:
    unreadable = [r.run for r in runs if r.verdict == "unreadable"]
    wrong = [*wrong, *([f"correct or remove the unreadable runs: {', '.join(unreadable)}"] if unreadable else [])]
    again = f"Then run 'vdyn check {inputs.source.path.name}' again: until then, it is not known which runs are good."
    return f"Correct the description first: {'. '.join(wrong)}. {again}"


def _sentence(runs: Sequence[CheckedRun], coasts: CoastBalance | None, vehicle: Sequence[Finding]) -> str:
    """The answer: doubts about the vehicle, the runs to repeat or those with notes, and missing directions or unmet
    limits of the campaign."""
    said = [*(f"Doubtful: {f.what}." for f in vehicle), _of_runs(runs)]
    if coasts is None:
        return " ".join(said)
    if not coasts.out and not coasts.back:
        said.append("No run states its direction.")
    elif not coasts.out or not coasts.back:
        said.append(f"All runs have the direction '{'out' if coasts.out else 'back'}': drive as many the other way.")
    unmet = [f"{x.regulation} {x.clause} ({x.found})" for x in coasts.limits if x.outcome == "not met"]
    if unmet:
        said.append(f"Not met: {'; '.join(unmet)}.")
    return " ".join(said)


def _of_runs(runs: Sequence[CheckedRun]) -> str:
    of = {verdict: [r.run for r in runs if r.verdict == verdict] for verdict in ("unreadable", "wrong", "repeat")}
    noted = [r.run for r in runs if r.why and r.verdict == "keep"]
    number = f"{len(runs)} {'run' if len(runs) == 1 else 'runs'}"
    words = {"unreadable": "Cannot read", "wrong": "Correct the entries of", "repeat": "Repeat"}
    said = [f"{words[v]} {len(names_)} of {number}: {', '.join(names_)}." for v, names_ in of.items() if names_]
    if of["repeat"]:
        return " ".join(said)
    if said or noted:
        said.append(f"No {'other ' if said else ''}run must be repeated.")
    if noted:
        return " ".join([*said, f"{len(noted)} of {number} with notes: {', '.join(noted)}."])
    if said:
        return " ".join(said)
    return f"All {number} are good." if len(runs) > 1 else "The run is good."


def _refused(inputs: Inputs, rejected: Collection[int]) -> VdynError:
    """The step's errors in its runs before any estimate, such as the sign of a channel; without findings if none.

    ``rejected``: indices of runs to be repeated, whose errors follow from that.
    """
    logs = tuple(one.log.name for k, one in enumerate(inputs.unsplit) if k not in rejected)
    try:
        with errors_of_step(inputs.step, inputs.source, inputs.logs):
            inputs.step.prepare(inputs.spec, inputs.data, inputs.known)
    except (InputError, ResultError) as error:
        found = (finding for finding in error.findings if finding.where.startswith(logs))
        return (InputError if isinstance(error, InputError) else ResultError)(*found)
    except ArithmeticError:  # from an estimate during the preparation
        pass
    return ResultError()


def _checked(inputs: Inputs, index: int, track: TrackCheck, refused: VdynError, tied: Sequence[TiedPair]) -> CheckedRun:
    """One run: whether it must be repeated, and why."""
    one, needed = inputs.unsplit[index], _needed(inputs.step)
    span = track.evaluated.get(index, (float(one.log.time[0]), float(one.log.time[-1])))
    continuous = index in track.evaluated  # a logger may pause between the parts of other tests
    lost, cuts = _lost(one, needed, span, continuous), [f for f in _flags(one) if f.decision == "cut"]
    wrong = [_text(f) for f in wrong_units(one.log.findings)]
    unusable = [f"vdyn {inputs.step.name} refuses it: {_text(f)}" for f in refused.findings if _about(f, one)]
    if wrong or (unusable and isinstance(refused, InputError)):  # all else may follow from a wrong description
        return _one_run(one, "wrong", wrong or unusable, lost)
    repeat = [*([track.rejected[index]] if index in track.rejected else []), *unusable]
    if lost > CHECK.most_lost:
        gaps = [f for f in _flags(one) if f.test == "clock_gap"] if continuous else []
        worst = max((*(f for f in cuts if f.channel in (*needed, EVERY)), *gaps), key=lambda f: f.share)
        of = "evaluated" if continuous else "logged"
        are = "missing" if worst.test == "clock_gap" else "cut"
        repeat.append(f"{100 * lost:.0f} % of the {of} {span[1] - span[0]:.0f} s are {are}: {_flag_text(worst)}")
    repeat += [_text(f) for f in one.log.findings if f.fault]
    repeat += [
        f"{f.channel} is saturated: {f.why} ({f.samples} samples); set the sensor's range"
        for f in _flags(one)
        if f.test == "saturated" and f.channel in needed
    ]
    notes = []
    if span[1] - span[0] < CHECK.least_evaluated * one.log.duration:
        evaluated = f"only {span[0]:.0f} to {span[1]:.0f} s of {one.log.duration:.0f} s"
        notes.append(f"{evaluated} would be evaluated: if the log is of another drive, remove it")
    notes += [f"cut: {_flag_text(f)}" for f in cuts]
    notes += track.left_out.get(index, ())
    notes += [_text(f) for f in track.findings if f.where == one.log.name]
    notes += _contradictions(inputs, one.log.name, tied)
    notes += [_text(f) for f in one.log.findings if f.doubt and not f.fault]
    notes += _uneven(one)
    notes += [_flag_text(f) for f in _flags(one) if f.test in ("missing", "clock_gap")]
    return _one_run(one, "repeat" if repeat else "keep", repeat or notes, lost)


def _until_corrected(inputs: Inputs, index: int, run: CheckedRun, contradicted: Sequence[Finding]) -> CheckedRun:
    """A run of a wrong description: wrong where its own entries are, else not judged."""
    places = {inputs.source.where(("runs", index, key)) for key in ("direction", "start")}
    about = [_text(f) for f in contradicted if f.where in places or _about(f, inputs.unsplit[index])]
    own = run.why if run.verdict == "wrong" else about
    why = own or ["not judged before the description is corrected"]
    return run.model_copy(update={"verdict": "wrong" if own else "unknown", "why": why})


def _about(finding: Finding, one: CutLog) -> bool:
    return finding.where.partition(", ")[0] == one.log.name or finding.where.startswith(f"{one.log.name} ")


def _one_run(one: CutLog, verdict: RunVerdict, why: Sequence[str], lost: float) -> CheckedRun:
    samples = int(one.log.time.size)
    return CheckedRun(
        run=one.log.name, verdict=verdict, why=list(why), duration=one.log.duration, samples=samples, lost=lost
    )


def _contradictions(inputs: Inputs, run: str, tied: Sequence[TiedPair]) -> Iterator[str]:
    """The contradicting pairs of channels of a run.

    Where the ratio of a pair from several loggers differs from that of most runs, the likely cause is added; a ratio
    that all runs share is a radius or a scale, even if only some exceed the limit.
    """
    several = any(clock.run == run for clock in inputs.clocks)
    for pair in tied:
        if pair.run == run and pair.good is False:
            alike = [p for p in tied if (p.first, p.second) == (pair.first, pair.second)]
            odd = several and any(p.good for p in alike) and not _usual_gain(pair, alike)
            mixed = "; its logs are probably not from one run" if odd else ""
            yield f"{pair.first} contradicts {pair.second}: {pair.what}{mixed}"


def _usual_gain(pair: TiedPair, alike: Sequence[TiedPair]) -> bool:
    """Whether the gain of a pair is the median of all runs, within ``run_ratio``."""
    gains = [p.gain for p in alike if p.gain is not None]
    return pair.gain is not None and abs(pair.gain / float(np.median(gains)) - 1.0) <= CHECK.run_ratio


def _uneven(one: CutLog) -> Iterator[str]:
    """A note if the steps of the clock differ by more than jitter, so that samples are missing."""
    steps = np.diff(one.whole.time)
    if steps.size >= _FEWEST_STEPS:
        low, usual, high = (float(x) for x in np.quantile(steps, (0.05, 0.5, 0.95)))
        if high - low > CHECK.uneven_clock * usual:
            yield f"uneven clock: 90 % of the steps lie between {low:.3g} s and {high:.3g} s; used as recorded"


def _text(finding: Finding) -> str:
    return f"{finding.what}" + (f" (got {finding.got})" if finding.got else "")


def _flag_text(flag: CheckFlag) -> str:
    meaning = TESTS.get(flag.test, "")
    more = f", and {flag.segments - 1} more" if flag.segments > 1 else ""
    at = (
        f"at {moment(flag.start)} s"
        if flag.start == flag.stop
        else f"from {moment(flag.start)} to {moment(flag.stop)} s"
    )
    channel = "all channels" if flag.channel == EVERY else flag.channel
    why = flag.why if flag.why.startswith("all channels") else f"{channel} {flag.why}"
    return f"{why}, {at}{f' ({meaning})' if meaning else ''}{more}"


def _needed(step: Step) -> tuple[str, ...]:
    """The channels that the step requires, including those from which they can be computed."""
    names_ = [n for entry in step.required for n in named_channels(entry)]
    sources = [one.source for one in step.scaled if one.target in names_]
    return tuple(n for n in (*names_, *sources) if n != "time")


def _lost(one: CutLog, needed: Sequence[str], span: tuple[float, float], continuous: bool) -> float:
    """Share of the time between two times in which a needed channel is cut or, in a continuous run, the clock pauses.

    A row lasts a usual step of the clock.
    """
    time = one.log.time
    inside = (time >= span[0]) & (time <= span[1])
    gone = np.zeros(time.size, dtype=bool)
    for row in one.ledger:
        if row.decision != "kept" and row.channel in (EVERY, *needed):
            gone |= (time >= row.start) & (time <= row.stop)
    if not inside.any():
        return 0.0
    paused = clock_gaps(time[inside]) if continuous else np.empty(0, dtype=np.intp)
    if not paused.size:
        return float(np.mean(gone[inside]))
    steps = np.diff(time[inside])
    usual, missing = float(np.median(steps)), float(steps[paused].sum())
    return (missing + usual * np.count_nonzero(gone[inside])) / (missing + usual * np.count_nonzero(inside))


def _flags(one: CutLog) -> Iterator[CheckFlag]:
    """The failed and suspect segments of a run, one entry per channel and test."""
    groups: dict[tuple[str, str, Decision], list[Segment]] = {}
    for row in one.ledger:
        decision: Decision = "kept" if row.decision == "kept" else "cut"
        groups.setdefault((row.channel, row.test, decision), []).append(_segment(row))
    time = one.whole.time
    for fault in one.flags.faults:
        if fault.state == Flag.SUSPECT:
            before = fault.test == "clock_gap"  # the gap ends at its first sample
            segment = (float(time[fault.first - before]), float(time[fault.stop - 1]), fault.samples, fault.why)
            groups.setdefault((fault.channel, fault.test, "marked"), []).append(segment)
    for name in one.whole.channels:
        holes = list(_holes(one, name))
        if holes:
            groups[name, "missing", "marked"] = holes
    for (channel, test, decision), segments in groups.items():
        first, last, _, why = max(segments, key=lambda s: (s[2], s[1] - s[0], -s[0]))
        samples = sum(s[2] for s in segments)
        duration = float(time[-1] - time[0])
        paused = sum(s[1] - s[0] for s in segments) / duration if test == "clock_gap" and duration > 0 else None
        yield CheckFlag.model_validate(
            {
                "run": one.log.name,
                "channel": channel,
                "test": test,
                "decision": decision,
                "segments": len(segments),
                "from": first,
                "to": last,
                "samples": samples,
                "share": samples / max(time.size, 1) if paused is None else paused,
                "why": why,
            }
        )


def _segment(row: LedgerRow) -> Segment:
    return row.start, row.stop, row.samples, row.why


def _holes(one: CutLog, name: str) -> Iterator[Segment]:
    """Gaps of a channel that has values elsewhere in the log; the whole log if it has hardly any."""
    time, rows = one.whole.time, np.flatnonzero(np.isfinite(one.whole[name]))
    if rows.size < 2:
        yield float(time[0]), float(time[-1]), int(time.size - rows.size), "has no values"
        return
    steps = np.diff(time[rows])
    least = max(CHECK.shortest_hole, CHECK.hole_steps * float(np.median(steps)))
    for k in np.flatnonzero((steps > least) & (np.diff(rows) > 1)):
        why = f"has no value for {steps[k]:.3g} s"
        yield float(time[rows[k] + 1]), float(time[rows[k + 1] - 1]), int(rows[k + 1] - rows[k] - 1), why
