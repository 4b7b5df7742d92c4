"""Simulates every segment of every drive, with sensitivities, from model, prior, effects and sensors."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from vdyn_cli.effects import Effect, effect
from vdyn_cli.engine.drive import Drive
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Correction, Law, Number, Signals
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.steps.validate.input_torque import DriveInputs
from vdyn_cli.steps.validate.prior import ParameterPrior, clipped_to_prior
from vdyn_cli.steps.validate.segments import DriveSegment
from vdyn_cli.steps.validate.sensors import Sensors, ideal_readings
from vdyn_cli.steps.validate.unknowns import START, TORQUE_ZERO, UnknownVector

T = TypeVar("T")

GAP_FACTOR = 3.0  # by which the longest step may exceed ``step`` where a clock has gaps
COARSE = 1e-3  # share of a channel's range by which half the step may change it
SHORTEST_STEP = 0.0005  # s, the shortest step that is tried for that reason
SAME_READING = 0.02  # m/s, difference of two readings of a start speed that is negligible
LEAST_SLOPE = 1e-3  # derivative of a reading to the speed, below which the reading does not determine the speed
JITTER = 1.05  # by which the jitter of a clock may exceed the step


@effect(
    on=("drive_torque", "drive_torque_left", "drive_torque_right"),
    unknowns=(Quantity(TORQUE_ZERO, "N m", "reading of the drive torque without torque, in one drive"),),
    reference="a data sheet's zero",
)
def drive_torque_zero(drive_torque: Law, s: Signals, q: Signals) -> Number:
    """The zero T0 of a torque sensor in one drive: T = reading - T0, N m."""
    return drive_torque(s.but(value=s.value - q.drive_torque_zero))


@dataclass(frozen=True)
class SimulatedSegment:
    """Outputs of one segment, each (n,), and their sensitivities to its vector of unknowns, each (n, k)."""

    values: Mapping[str, Array]
    sensitivities: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class SimulationSetup:
    """Everything needed to simulate the drives; each simulation is computed once and kept.

    Parameters
    ----------
    inputs : the segments and their input torques.
    model : the full vehicle or the road load.
    prior : of the parameters. sensors : the compared channels, with unknown gains and zeros.
    step : s, the longest step of the integration, except for clock jitter (``JITTER``) and gaps (``GAP_FACTOR``).
    effects, extra : corrections of the model's laws, and the unknowns of those whose amplitude is estimated.
    at : start values of parameters that do not start at their prior mean.
    torque_zeros : N m, start value of the drive torque's zero in each segment; empty: 0.
    start_speeds : m/s, with which the simulation of each segment starts; empty: as measured.
    baseline : the setup without ``extra``, ``at`` and ``torque_zeros``; None: created when needed.
    extended : the setup to which the effects were added; its simulation is valid while their amplitudes are zero.
    secants : amplitudes over which secants for nondifferentiable effects are taken; others: over a probe.
    chord : whether the sensitivities to the parameters are those of the bare car, for a third of the cost: sufficient
        for the first iterations of a fit (chord method).
    """

    inputs: DriveInputs
    model: Model
    prior: ParameterPrior
    sensors: Sensors
    step: float
    effects: tuple[Correction, ...] = ()
    extra: tuple[Unknown, ...] = ()
    at: Mapping[str, float] = field(default_factory=dict)
    torque_zeros: tuple[float, ...] = ()
    start_speeds: tuple[float, ...] = ()
    baseline: SimulationSetup | None = None
    extended: SimulationSetup | None = None
    secants: Mapping[str, float] = field(default_factory=dict)
    chord: bool = False

    def with_effects(self, effects: Sequence[Effect], unknowns: Sequence[Unknown]) -> SimulationSetup:
        """The setup with further effects in the model."""
        if not effects and not unknowns:
            return self
        added = (*self.effects, *effects)
        return replace(self, effects=added, extra=tuple(unknowns), baseline=self.bare, extended=self)

    def begun_at(self, values: Mapping[str, float]) -> SimulationSetup:
        """The setup with its parameters starting at these values, within 5 standard deviations of the prior."""
        return replace(self, at=clipped_to_prior(self.prior, values), baseline=self.bare)

    @property
    def segments(self) -> tuple[DriveSegment, ...]:
        """The segments, each simulated without interruption."""
        return self.inputs.segments

    @cached_property
    def vector(self) -> UnknownVector:
        """The order, start values and priors of the unknowns."""
        starts = tuple(s.start for s in self.segments)
        return UnknownVector(
            self.prior, self.sensors, self.extra, self.at, self.torque_zeros, starts, self.start_speeds
        )

    @property
    def nondifferentiable(self) -> tuple[str, ...]:
        """Amplitudes of effects without a derivative at zero (free play)."""
        return tuple(next(iter(e.unknowns)) for e in self.effects if e.probes)

    @property
    def nondifferentiable_prior(self) -> tuple[str, ...]:
        """The nondifferentiable amplitudes that earlier steps estimated as nonzero."""
        return tuple(n for n in self.nondifferentiable if self.prior.values.get(n))

    @cached_property
    def bare(self) -> SimulationSetup:
        """The vehicle at its prior without added effects; for a mass on a road, which is cheap, the setup itself."""
        if self.model.name != "vehicle" or not (self.extra or self.at or self.torque_zeros):
            return self
        return self.baseline or replace(
            self, effects=self._unadded, extra=(), at={}, torque_zeros=(), start_speeds=(), baseline=None, extended=None
        )

    @property
    def _unadded(self) -> tuple[Correction, ...]:
        """Effects with known amplitudes."""
        added = {u.name for u in self.extra}
        return tuple(e for e in self.effects if not added & set(e.unknowns))

    @cached_property
    def unextended(self) -> SimulationSetup | None:
        """For the full vehicle, the setup without the added effects if their amplitudes start at zero; else None.

        Its simulation is the same, so that only the sensitivities to the effects have to be added.
        """
        shapes = {n for e in self.effects for n in e.nominal}
        zero = all(u.start == 0.0 for u in self.extra if u.name not in shapes)
        if not self.extra or not zero or self.model.name != "vehicle":
            return None
        known = self.extended
        mine = self.at, self.torque_zeros, self.start_speeds
        if known is not None and (known.at, known.torque_zeros, known.start_speeds) == mine:
            return known
        return replace(self, effects=self._unadded, extra=(), baseline=self.bare, extended=None)

    @cached_property
    def simulator(self) -> Simulator:
        """The simulator with sensitivities to all unknowns in ``vector.simulated``."""
        return _whole_simulator(self, (*self.prior.names, *(u.name for u in self.extra)))

    @cached_property
    def chord_simulator(self) -> Simulator:
        """The simulator with sensitivities to the unknowns after the parameters, which keep their start values."""
        return _whole_simulator(self, tuple(u.name for u in self.extra))

    @cached_property
    def first(self) -> tuple[SimulatedSegment, ...]:
        """Every segment at the start values, with sensitivities.

        Raises
        ------
        ResultError : the simulation is not finite.
        """
        if self.unextended is None and self.chord:
            assert self.bare.first  # both are computed before threads need them
            assert self.chord_simulator.outputs
            return self.each(lambda k: _first_by_chord(self, k))
        if self.unextended is None:
            return self.each(lambda k: self.simulate(k, self.vector.start(k)))
        before, at = self.unextended.first, len(self.unextended.vector.shared)
        return tuple(
            SimulatedSegment(
                o.values, {n: np.hstack([s[:, :at], new[n], s[:, at:]]) for n, s in o.sensitivities.items()}
            )
            for o, new in zip(before, _added_sensitivities(self), strict=True)
        )

    @cached_property
    def perturbed(self) -> tuple[Mapping[str, Array], ...]:
        """Change of the outputs of every segment by additional noise of the torque sensor's level.

        Always of the bare car, so that fits with different effects have the same weights.
        """
        bare = self.bare
        if bare is not self:
            return bare.perturbed
        assert self.inputs.perturbed_drives  # computed before threads need them
        seen = self.each(lambda k: self.simulate(k, self.vector.start(k), slopes=False, perturbed=True))
        return tuple({n: a.values[n] - b.values[n] for n in b.values} for a, b in zip(seen, self.first, strict=True))

    def each(self, work: Callable[[int], T]) -> tuple[T, ...]:
        """The results of ``work`` for every segment, in threads if the simulator allows it, the longest first."""
        count = len(self.segments)
        workers = min(count, os.cpu_count() or 1) if self.simulator.at_once else 1
        if workers < 2:
            return tuple(work(k) for k in range(count))
        order = sorted(range(count), key=lambda k: -self.segments[k].time.size)
        assert self.inputs.drives  # computed before threads need them
        with ThreadPoolExecutor(workers) as pool:
            done = dict(zip(order, pool.map(work, order), strict=True))
        return tuple(done[k] for k in range(count))

    def simulate(self, segment: int, theta: Array, slopes: bool = True, perturbed: bool = False) -> SimulatedSegment:
        """Simulate one segment at its vector of unknowns.

        Parameters
        ----------
        theta : (shared + own,), in the order of ``vector``. slopes : whether sensitivities are computed.
        perturbed : whether its torques have additional noise.

        Raises
        ------
        ResultError : the simulation is not finite.
        """
        drive = (self.inputs.perturbed_drives if perturbed else self.inputs.drives)[segment]
        seen = self.simulator(drive, theta[self.vector.simulated], sensitivities=slopes)
        values, derivatives = ideal_readings(seen)
        if not slopes:
            return _read(self, values, {}, {}, theta)
        k = len(self.prior.names)
        steady, others = ({n: d[:, part] for n, d in derivatives.items()} for part in (slice(k), slice(k, None)))
        return _read(self, values, steady, others, theta)


def _first_by_chord(setup: SimulationSetup, segment: int) -> SimulatedSegment:
    theta, k = setup.vector.start(segment), len(setup.prior.names)
    seen = setup.chord_simulator(setup.inputs.drives[segment], theta[setup.vector.simulated][k:])
    values, derivatives = ideal_readings(seen)
    bare = {n: d[:, :k] for n, d in setup.bare.first[segment].sensitivities.items()}
    return _read(setup, values, bare, derivatives, theta)


def _read(
    setup: SimulationSetup,
    ideal: Mapping[str, Array],
    steady: Mapping[str, Array],
    others: Mapping[str, Array],
    theta: Array,
) -> SimulatedSegment:
    """The readings of the sensors, with derivatives to parameters (``steady``), gains, ``others`` and zeros."""
    sensors, k = setup.sensors, len(setup.prior.names)
    gains, zeros = theta[k : k + len(sensors.gain_std)], theta[len(setup.vector.shared) + 1 + sensors.input_zeros :]
    values, derivatives = dict[str, Array](), dict[str, Array]()
    for name, value in ideal.items():
        values[name], columns = sensors.read(name, value, gains, zeros)
        if name in others:
            derivatives[name] = np.hstack([steady[name], columns[0], others[name], columns[1]])
    return SimulatedSegment(values, derivatives)


def _whole_simulator(setup: SimulationSetup, shared: tuple[str, ...]) -> Simulator:
    """The simulator with sensitivities to shared unknowns, start speed and zero of the drive torque."""
    if setup.sensors.input_zeros:
        return _simulator(setup, (*shared, START, TORQUE_ZERO), (*setup.effects, drive_torque_zero))
    return _simulator(setup, (*shared, START), setup.effects)


def _simulator(setup: SimulationSetup, unknowns: tuple[str, ...], effects: tuple[Correction, ...]) -> Simulator:
    values = {**setup.prior.values, **setup.at, "wind_variance": 0.0}
    own = {n: values[n] for n in (*setup.model.parameters, *setup.prior.names)}
    dense = max(_substeps(s.time, setup.step) for s in setup.segments)
    return Simulator(setup.model, own, unknowns, effects, dense)


def _substeps(time: Array, step: float) -> int:
    """Number of integration steps per sample."""
    steps = np.diff(time)
    longest = max(float(np.median(steps)), float(steps.max()) / GAP_FACTOR)
    return max(1, int(np.ceil(longest / step / JITTER)))


def with_read_starts(setup: SimulationSetup) -> SimulationSetup:
    """The setup whose simulated speed sensor reads the measured speed at the first sample of each segment.

    One Newton step per segment, V0 = V + (measured - reading) / (d reading / dV): exact for a sensor's gain.
    Unchanged if all readings agree already, for example without effects in the model.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    speeds, agree, place = [], True, len(setup.vector.shared)
    for k, o in enumerate(setup.first):
        measured, std = setup.vector.start_speed(k)
        off, slope = measured - o.values["speed"][0], o.sensitivities["speed"][0, place]
        agree &= bool(abs(off) < max(std, SAME_READING))
        speeds.append(setup.vector.first_speed(k) + (off / slope if slope > LEAST_SLOPE else 0.0))
    return setup if agree else replace(setup, start_speeds=tuple(speeds))


def rms_speed_error(setup: SimulationSetup) -> float:
    """Rms error of the speed, m/s, at the start values; each segment starts where its sensor reads the measured speed.

    A nonzero start speed is scaled by measured over read speed, which is exact for a sensor's gain. For the full
    vehicle, which is expensive to simulate, only the first segment is used.

    Raises
    ------
    ResultError : a simulation is not finite.
    """
    place = len(setup.vector.shared)

    def squares(k: int) -> tuple[float, int]:
        theta, measured = setup.vector.start(k), setup.segments[k].outputs["speed"]
        speed = setup.simulate(k, theta, slopes=False).values["speed"]
        if theta[place] > 0.0 < speed[0] and abs(theta[place] - speed[0]) > SAME_READING:
            theta[place] *= theta[place] / speed[0]
            speed = setup.simulate(k, theta, slopes=False).values["speed"]
        error = (speed - measured)[np.isfinite(measured)]
        return float(error @ error), error.size

    if setup.model.name == "vehicle":
        found: tuple[tuple[float, int], ...] = (squares(0),)
    else:
        found = setup.each(squares)
    return float(np.sqrt(sum(s for s, _ in found) / sum(n for _, n in found)))


def with_accurate_step(setup: SimulationSetup) -> SimulationSetup:
    """The setup with its step halved until half a step changes no channel by ``COARSE`` of its range.

    Raises
    ------
    ResultError : the simulation is not finite in the shortest of them.
    """
    half = replace(setup, step=setup.step / 2)
    last = half.step < SHORTEST_STEP

    def error(segment: int) -> float:
        """Largest change of a compared channel by half the step, as a share of its range."""
        start = setup.vector.start(segment)[setup.vector.simulated]
        errors = setup.simulator.step_error(setup.inputs.drives[segment], start)
        return max(errors[n] for n in setup.sensors.channels)

    try:
        worst = max(setup.each(error))
    except ResultError:
        if last:
            raise
        return with_accurate_step(half)
    return setup if last or worst < COARSE else with_accurate_step(half)


def _added_sensitivities(setup: SimulationSetup) -> tuple[Mapping[str, Array], ...]:
    """The sensitivities of every segment to the unknowns of effects; secants for nondifferentiable ones."""
    secant = _secant(setup)

    def added(segment: int) -> dict[str, Array]:
        without, slopes = ideal_readings(secant.adding(secant.drive(segment), secant.start))
        for i in secant.sizes:
            for n, column in secant.column(segment, i, without).items():
                slopes[n][:, i] = column
        return slopes

    return setup.each(added)


def with_secants(setup: SimulationSetup, secants: Mapping[str, float]) -> SimulationSetup:
    """The setup whose secants for nondifferentiable effects are taken over these amplitudes."""
    made, seen = replace(setup, secants=secants), setup.first
    # The simulations stay valid. Away from zero amplitude no sensitivity is a secant.
    vars(made)["first"] = seen if setup.unextended is None else _with_other_secants(made, seen)
    return made


def _with_other_secants(setup: SimulationSetup, seen: Sequence[SimulatedSegment]) -> tuple[SimulatedSegment, ...]:
    """The simulated segments ``seen`` with secants recomputed over the amplitudes of ``setup``."""
    assert setup.unextended is not None
    secant, at = _secant(setup), len(setup.unextended.vector.shared)

    def changed(segment: int) -> SimulatedSegment:
        outcome = seen[segment]
        without = ideal_readings(secant.adding(secant.drive(segment), secant.start, sensitivities=False))[0]
        slopes = {n: d.copy() for n, d in outcome.sensitivities.items()}
        for i in secant.sizes:
            for n, column in secant.column(segment, i, without).items():
                slopes[n][:, at + i] = column
        return SimulatedSegment(outcome.values, slopes)

    return setup.each(changed)


@dataclass(frozen=True, eq=False)
class _Secant:
    """Secants of a setup.

    Parameters
    ----------
    adding : simulator with the unknowns of effects. start : (k,) their start values.
    sizes : by index of each nondifferentiable unknown, the amplitude over which its secant is taken.
    """

    setup: SimulationSetup
    adding: Simulator
    start: Array
    sizes: Mapping[int, float]

    def drive(self, segment: int) -> Drive:
        """The inputs of one segment."""
        begun = {"speed": self.setup.vector.first_speed(segment)}
        return replace(self.setup.inputs.drives[segment], start=begun)

    def column(self, segment: int, index: int, without: Mapping[str, Array]) -> dict[str, Array]:
        """The secant of every channel, each (n,), over its readings ``without`` the effect."""
        size = self.sizes[index]
        moved = self.start + size * (np.arange(self.start.size) == index)
        seen = self.adding(self.drive(segment), moved, sensitivities=False)
        values = ideal_readings(seen)[0]
        return {n: (value - without[n]) / size for n, value in values.items()}


def _secant(setup: SimulationSetup) -> _Secant:
    adding = _simulator(setup, tuple(u.name for u in setup.extra), setup.effects)
    assert adding.outputs  # computed before threads need it
    return _Secant(setup, adding, np.array([u.start for u in setup.extra]), _secant_sizes(setup))


def _secant_sizes(setup: SimulationSetup) -> dict[int, float]:
    """By index of each nondifferentiable unknown, the amplitude over which its secant is taken."""
    places = {u.name: i for i, u in enumerate(setup.extra)}
    sizes = {next(iter(e.unknowns)): e.probes[len(e.probes) // 3] for e in setup.effects if e.probes}
    sizes |= setup.secants
    return {places[n]: size for n, size in sizes.items() if n in places}
