"""Simulates every segment of every drive, with sensitivities, from model, prior, effects and sensors."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from vdyn_cli.effects import effect
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Correction, Law, Number, Signals
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.validate.car.prior import ParameterPrior, clipped_to_prior
from vdyn_cli.steps.validate.car.sensors import Sensors, ideal_readings
from vdyn_cli.steps.validate.car.unknowns import START, TORQUE_ZERO, UnknownVector
from vdyn_cli.steps.validate.drives.complete_inputs import DRIVE_TORQUES
from vdyn_cli.steps.validate.drives.input_torque import DriveInputs
from vdyn_cli.steps.validate.drives.segments import DriveSegment

T = TypeVar("T")

GAP_FACTOR = 3.0  # by which the longest step may exceed ``step`` where a clock has gaps
JITTER = 1.05  # by which the jitter of a clock may exceed the step


@effect(
    on=DRIVE_TORQUES,
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
class Car:
    """What all simulations of a validation share: the drives, and the car as far as it is known.

    Parameters
    ----------
    inputs : the segments and their input torques.
    model : the full vehicle or the road load.
    prior : of the parameters. sensors : the compared channels, with unknown gains and zeros.
    step : s, the longest step of the integration, except for clock jitter (``JITTER``) and gaps (``GAP_FACTOR``).
    effects : corrections of the model's laws whose amplitudes earlier steps estimated; the prior contains these.
    """

    inputs: DriveInputs
    model: Model
    prior: ParameterPrior
    sensors: Sensors
    step: float
    effects: tuple[Correction, ...] = ()

    @property
    def known_play(self) -> tuple[str, ...]:
        """The nondifferentiable amplitudes that earlier steps estimated as nonzero."""
        return tuple(n for n in nondifferentiable(self.effects) if self.prior.values.get(n))

    @cached_property
    def at_prior(self) -> SimulationSetup:
        """The car with the prior's parameters and without added effects."""
        return StartPoint(self).without_effects


@dataclass(frozen=True, eq=False)
class StartPoint:
    """The point at which a car is simulated and linearized.

    Parameters
    ----------
    at : values of parameters that are not at their prior mean.
    torque_zeros : N m, the drive torque's zero in each segment; empty: 0.
    start_speeds : m/s, with which the simulation of each segment starts; empty: as measured.
    """

    car: Car
    at: Mapping[str, float] = field(default_factory=dict)
    torque_zeros: tuple[float, ...] = ()
    start_speeds: tuple[float, ...] = ()

    @cached_property
    def without_effects(self) -> SimulationSetup:
        """The car without added effects at this point; setups with effects share its simulation."""
        return SimulationSetup(self)


@dataclass(frozen=True, eq=False)
class SimulationSetup:
    """A car at one point, with added effects; its simulation is computed once and kept.

    Parameters
    ----------
    point : the car and the point.
    added : effects with unknown amplitudes.
    secants : amplitudes over which secants for nondifferentiable effects are taken; others: over a probe.
    chord : whether the sensitivities to the parameters are those of the car at its prior, for a third of the cost:
        sufficient for the first iterations of a fit (chord method).
    """

    point: StartPoint
    added: AddedEffects = NO_EFFECTS
    secants: Mapping[str, float] = field(default_factory=dict)
    chord: bool = False

    def with_effects(self, added: AddedEffects) -> SimulationSetup:
        """The setup with further effects in the model."""
        return replace(self, added=self.added + added) if added else self

    def moved_to(self, point: StartPoint) -> SimulationSetup:
        """The setup at another point."""
        return replace(self, point=point) if self.added else point.without_effects

    def begun_at(self, values: Mapping[str, float]) -> SimulationSetup:
        """The setup with its parameters starting at these values, within 5 standard deviations of the prior."""
        return self.moved_to(replace(self.point, at=clipped_to_prior(self.prior, values)))

    @property
    def model(self) -> Model:
        """The full vehicle or the road load."""
        return self.point.car.model

    @property
    def prior(self) -> ParameterPrior:
        """The prior of the parameters."""
        return self.point.car.prior

    @property
    def sensors(self) -> Sensors:
        """The compared channels."""
        return self.point.car.sensors

    @property
    def segments(self) -> tuple[DriveSegment, ...]:
        """The segments, each simulated without interruption."""
        return self.point.car.inputs.segments

    @property
    def effects(self) -> tuple[Correction, ...]:
        """All effects in the model."""
        return (*self.point.car.effects, *self.added.effects)

    @cached_property
    def vector(self) -> UnknownVector:
        """The order, start values and priors of the unknowns."""
        starts, point = tuple(s.start for s in self.segments), self.point
        added = self.added.unknowns
        return UnknownVector(self.prior, self.sensors, added, point.at, point.torque_zeros, starts, point.start_speeds)

    @cached_property
    def simulator(self) -> Simulator:
        """The simulator with sensitivities to all unknowns in ``vector.simulated``."""
        return _whole_simulator(self, (*self.prior.names, *self.added.names))

    @cached_property
    def chord_simulator(self) -> Simulator:
        """The simulator with sensitivities to the unknowns after the parameters, which keep their start values."""
        return _whole_simulator(self, self.added.names)

    @cached_property
    def first(self) -> tuple[SimulatedSegment, ...]:
        """Every segment at the start values, with sensitivities.

        Raises
        ------
        ResultError : the simulation is not finite.
        """
        if self.model.name == "vehicle" and self.added.unknowns and added_at_zero(self):
            return _with_added_sensitivities(self)
        if self.chord:
            assert self.point.car.at_prior.first  # both are computed before threads need them
            assert self.chord_simulator.outputs
            return self.each(lambda k: _first_by_chord(self, k))
        return self.each(lambda k: self.simulate(k, self.vector.start(k)))

    @cached_property
    def perturbed(self) -> tuple[Mapping[str, Array], ...]:
        """Change of the outputs, (n,) each, of every segment by additional noise of the torque sensor's level.

        For a full vehicle always of the car at its prior, so that fits with different effects have the same weights.
        """
        car = self.point.car
        if self.model.name == "vehicle" and self is not car.at_prior:
            return car.at_prior.perturbed
        assert self.point.car.inputs.perturbed_drives  # computed before threads need them
        seen = self.each(lambda k: self.simulate(k, self.vector.start(k), slopes=False, perturbed=True))
        return tuple({n: a.values[n] - b.values[n] for n in b.values} for a, b in zip(seen, self.first, strict=True))

    def each(self, work: Callable[[int], T]) -> tuple[T, ...]:
        """The results of ``work`` for every segment, in threads if the simulator allows it, the longest first."""
        count = len(self.segments)
        workers = min(count, os.cpu_count() or 1) if self.simulator.at_once else 1
        if workers < 2:
            return tuple(work(k) for k in range(count))
        order = sorted(range(count), key=lambda k: -self.segments[k].time.size)
        assert self.point.car.inputs.drives  # computed before threads need them
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
        inputs = self.point.car.inputs
        drive = (inputs.perturbed_drives if perturbed else inputs.drives)[segment]
        seen = self.simulator(drive, theta[self.vector.simulated], sensitivities=slopes)
        values, derivatives = ideal_readings(seen)
        if not slopes:
            return _read(self, values, {}, {}, theta)
        k = len(self.prior.names)
        steady, others = ({n: d[:, part] for n, d in derivatives.items()} for part in (slice(k), slice(k, None)))
        return _read(self, values, steady, others, theta)


def nondifferentiable(effects: Sequence[Correction]) -> tuple[str, ...]:
    """Amplitudes of effects without a derivative at zero (free play)."""
    return tuple(next(iter(e.unknowns)) for e in effects if e.probes)


def added_at_zero(setup: SimulationSetup) -> bool:
    """Whether the added effects start at zero amplitude, where they change sensitivities only."""
    shapes = {n for e in setup.added.effects for n in e.nominal}
    return all(u.start == 0.0 for u in setup.added.unknowns if u.name not in shapes)


def _first_by_chord(setup: SimulationSetup, segment: int) -> SimulatedSegment:
    theta, k = setup.vector.start(segment), len(setup.prior.names)
    seen = setup.chord_simulator(setup.point.car.inputs.drives[segment], theta[setup.vector.simulated][k:])
    values, derivatives = ideal_readings(seen)
    known = {n: d[:, :k] for n, d in setup.point.car.at_prior.first[segment].sensitivities.items()}
    return _read(setup, values, known, derivatives, theta)


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
    values = {**setup.prior.values, **setup.point.at, "wind_variance": 0.0}
    own = {n: values[n] for n in (*setup.model.parameters, *setup.prior.names)}
    dense = max(_substeps(s.time, setup.point.car.step) for s in setup.segments)
    return Simulator(setup.model, own, unknowns, effects, dense)


def _substeps(time: Array, step: float) -> int:
    """Number of integration steps per sample."""
    steps = np.diff(time)
    longest = max(float(np.median(steps)), float(steps.max()) / GAP_FACTOR)
    return max(1, int(np.ceil(longest / step / JITTER)))


def _with_added_sensitivities(setup: SimulationSetup) -> tuple[SimulatedSegment, ...]:
    """The simulation without added effects, with sensitivities (nondifferentiable: secants) to their unknowns."""
    before, drives = setup.point.without_effects, setup.point.car.inputs.drives
    seen, place = before.first, len(before.vector.shared)
    adding = _simulator(setup, setup.added.names, setup.effects)
    assert adding.outputs  # computed before threads need it
    start, sizes = np.array([u.start for u in setup.added.unknowns]), _secant_sizes(setup)

    def segment(k: int) -> SimulatedSegment:
        drive = replace(drives[k], start={"speed": setup.vector.first_speed(k)})
        without, added = ideal_readings(adding(drive, start))
        for i, size in sizes.items():
            moved = start + size * (np.arange(start.size) == i)
            values, _ = ideal_readings(adding(drive, moved, sensitivities=False))
            for n, value in values.items():
                added[n][:, i] = (value - without[n]) / size
        slopes = seen[k].sensitivities
        return SimulatedSegment(
            seen[k].values, {n: np.hstack([s[:, :place], added[n], s[:, place:]]) for n, s in slopes.items()}
        )

    return setup.each(segment)


def _secant_sizes(setup: SimulationSetup) -> dict[int, float]:
    """By index of each nondifferentiable unknown, the amplitude over which its secant is taken."""
    places = {name: i for i, name in enumerate(setup.added.names)}
    sizes = {next(iter(e.unknowns)): e.probes[len(e.probes) // 3] for e in setup.effects if e.probes}
    sizes |= setup.secants
    return {places[n]: size for n, size in sizes.items() if n in places}
