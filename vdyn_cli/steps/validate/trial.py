"""The simulated car beside the measured one: model, simulator and what is known, for every stretch of every drive."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.effects import effect
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Correction, Law, Number, Signals
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.steps.validate.drives import Stretch
from vdyn_cli.steps.validate.given import Beliefs
from vdyn_cli.steps.validate.sensors import Sensors, true_readings
from vdyn_cli.steps.validate.sought import believed, near_belief
from vdyn_cli.steps.validate.torque import Fed, Torques, fed

Array = NDArray[np.float64]
T = TypeVar("T")

START = "start.speed"
TORQUE_ZERO = "drive_torque_zero"
WHEELS = ("wheel_speed_fl", "wheel_speed_fr", "wheel_speed_rl", "wheel_speed_rr")
REST = 0.3  # m/s, below which a drive begins at rest
AT_REST = 1e-3  # m/s, how well a car at rest is known to be
UNEVEN = 3.0  # spacings of the clock that one step size must still bear
COARSE = 1e-3  # of a channel's range: what half the step may change
SHORTEST_STEP = 0.0005  # s, that is taken for that reason
EASE = 1.05  # of the step length: what the clock's own trembling may add


@effect(
    on=("drive_torque", "drive_torque_left", "drive_torque_right"),
    unknowns=(Quantity(TORQUE_ZERO, "N m", "what the drive torque reads at no torque, in one drive"),),
    reference="a data sheet's zero",
)
def drive_torque_zero(drive_torque: Law, s: Signals, q: Signals) -> Number:
    """The zero of a torque sensor in one drive."""
    return drive_torque(s.but(value=s.value - q.drive_torque_zero))


@dataclass(frozen=True)
class Outcome:
    """Outputs of one stretch and their derivatives: each (n,) and (n, k) to beliefs, extra unknowns, own unknowns."""

    values: Mapping[str, Array]
    slopes: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class Trial:
    """Everything that simulates the drives.

    Parameters
    ----------
    stretches : what is simulated, each in one go.
    model : the full vehicle or the road load.
    beliefs : the parameters before the drives.
    channels : outputs that are fitted, of those that the model has and the logs hold.
    effects, extra : corrections of the model's laws, and their unknowns.
    step : s, the longest step of the integration, but for a trembling clock (``EASE``) and gaps (``UNEVEN``).
    zeros : standard deviation of a sensor's zero, by channel or drive_torque; each stretch has its own.
    gains : standard deviation of a sensor's gain, by channel; the same in all stretches, and of both shaft torques.
    wind_variance : m^2/s^2, of gusts and mean winds: what they add to the mean drag.
    day : K, temperature at which the air density holds, where each stretch has its own air; None: one air for all.
    at : values at which believed parameters begin, where that is not where they are believed to be.
    torque_zeros : N m, the drive torque's zero at which each stretch begins; none: nothing.
    """

    stretches: tuple[Stretch, ...]
    model: Model
    beliefs: Beliefs
    channels: tuple[str, ...]
    step: float
    zeros: Mapping[str, float]
    gains: Mapping[str, float]
    effects: tuple[Correction, ...] = ()
    extra: tuple[Unknown, ...] = ()
    wind_variance: float = 0.0
    day: float | None = None
    at: Mapping[str, float] = field(default_factory=dict)
    torque_zeros: tuple[float, ...] = ()

    @property
    def plays(self) -> tuple[str, ...]:
        """Sizes of effects that have no slope at nothing: with them gears knock."""
        return tuple(next(iter(e.unknowns)) for e in self.effects if e.probes)

    @property
    def carried_plays(self) -> tuple[str, ...]:
        """Those that the car is believed to have."""
        return tuple(n for n in self.plays if self.beliefs.values.get(n))

    @cached_property
    def sensors(self) -> Sensors:
        """How the outputs are read."""
        return Sensors(self.channels, self.zeros, self.gains)

    @property
    def zeroed(self) -> tuple[str, ...]:
        """Channels whose zero is a nuisance of every stretch; the drive torque's, which drives the car, first."""
        return self.sensors.zeroed

    @property
    def instruments(self) -> dict[str, float]:
        """Unknowns of the readings that all stretches share, with their standard deviations about zero."""
        return self.sensors.instruments

    @property
    def own(self) -> tuple[str, ...]:
        """A stretch's own unknowns."""
        return (START, *(f"{name}_zero" for name in self.zeroed))

    @property
    def shared(self) -> tuple[str, ...]:
        """Beliefs, instruments, extra unknowns."""
        return (*self.beliefs.names, *self.instruments, *(u.name for u in self.extra))

    @cached_property
    def _moving(self) -> NDArray[np.int64]:
        """Places among a stretch's unknowns of those that the simulator takes."""
        k, m = len(self.beliefs.names), len(self.instruments)
        end = len(self.shared) + 1 + self.sensors.driving
        return np.concatenate([np.arange(k), np.arange(k + m, end)]).astype(np.int64)

    @cached_property
    def _plain(self) -> Trial | None:
        """The same car with nothing added, where what is added is nothing so far: it drives alike.

        Only of the full vehicle, which is dear to simulate.
        """
        shapes = {n for e in self.effects for n in e.nominal}
        nothing = all(u.start == 0.0 for u in self.extra if u.name not in shapes)
        if not self.extra or not nothing or self.model.name != "vehicle":
            return None
        added = {u.name for u in self.extra}
        return remembered(
            replace(self, effects=tuple(e for e in self.effects if not added & set(e.unknowns)), extra=())
        )

    @cached_property
    def bare(self) -> Trial:
        """The car as it is believed to be, with nothing added; a mass on a road is what it is."""
        if self.model.name != "vehicle" or not (self.extra or self.at or self.torque_zeros):
            return self
        added = {u.name for u in self.extra}
        effects = tuple(e for e in self.effects if not added & set(e.unknowns))
        return remembered(replace(self, effects=effects, extra=(), at={}, torque_zeros=()))

    @property
    def drives_alike(self) -> Hashable:
        """Everything that it is made of."""
        b = self.beliefs
        believed = b.names, tuple(b.values.items()), b.std.tobytes(), b.correlation.tobytes()
        sensors = self.channels, tuple(self.zeros.items()), tuple(self.gains.items()), self.wind_variance, self.day
        begun = tuple(self.at.items()), self.torque_zeros
        return self.stretches, self.model, believed, begun, sensors, self.effects, self.extra, self.step

    @cached_property
    def _outputs(self) -> tuple[str, ...]:
        return self._plain._outputs if self._plain else self._simulator.outputs

    @cached_property
    def _simulator(self) -> Simulator:
        unknowns = (*self.beliefs.names, *(u.name for u in self.extra), START)
        if self.sensors.driving:
            return self._simulates((*unknowns, TORQUE_ZERO), (*self.effects, drive_torque_zero))
        return self._simulates(unknowns, self.effects)

    @cached_property
    def _adding(self) -> Simulator:
        """Simulates what is added alone."""
        return self._simulates(tuple(u.name for u in self.extra), self.effects)

    def _simulates(self, unknowns: tuple[str, ...], effects: tuple[Correction, ...]) -> Simulator:
        dense = max(self._substeps(s.time) for s in self.stretches)
        values = {**self.beliefs.values, **self.at, "wind_variance": self.wind_variance}
        own = {n: values[n] for n in self.model.parameters}
        return Simulator(self.model, own, unknowns, effects, dense)

    def _substeps(self, time: Array) -> int:
        steps = np.diff(time)
        longest = max(float(np.median(steps)), float(steps.max()) / UNEVEN)
        return max(1, int(np.ceil(longest / self.step / EASE)))

    @cached_property
    def fine_step(self) -> float:
        """s, the length of its steps or half of it, and so on, until half a step changes no channel by ``COARSE``.

        Raises
        ------
        ResultError : the simulation is not finite in the shortest of them.
        """
        half = replace(self, step=self.step / 2)
        last = half.step < SHORTEST_STEP
        try:
            worst = max(self.each(self._step_error))
        except ResultError:
            if last:
                raise
            return half.fine_step
        return self.step if last or worst < COARSE else half.fine_step

    def _step_error(self, run: int) -> float:
        """What half a step changes in a channel of one stretch, at worst, as a share of its range."""
        errors = self._simulator.step_error(self.drives[run], self.start(run)[self._moving])
        return max(errors[n] for n in self.channels)

    @property
    def torques(self) -> tuple[Fed, ...]:
        zero = self.zeros.get("drive_torque", 0.0)
        return fed(self.stretches, self.model.inputs, "shaft_torque_left" in self._outputs, zero)

    @cached_property
    def drives(self) -> tuple[Drive, ...]:
        return tuple(self._drive(s, one.calm) for s, one in zip(self.stretches, self.torques, strict=True))

    @cached_property
    def _shaken_drives(self) -> tuple[Drive, ...]:
        return tuple(self._drive(s, one.shaken) for s, one in zip(self.stretches, self.torques, strict=True))

    def _drive(self, s: Stretch, torques: Torques) -> Drive:
        everything = {
            **s.inputs,
            "elapsed": s.since + s.time - s.time[0],
            **{f"road_{wheel}": 0.0 for wheel in ("fl", "fr", "rl", "rr")},
            **torques.values,
        }
        inputs = {n: everything[n] for n in self.model.inputs}
        own = {}
        if self.day is not None:
            own["air_density"] = self.beliefs.values["air_density"] * self.day / s.temperature
        context = {"heading": s.heading, "temperature": s.temperature}
        return Drive(s.time, inputs, {}, own, context, torques.corners)

    def start(self, run: int) -> Array:
        """Local unknowns of a stretch where they begin."""
        local = np.array([*self.theta(), self.begun(run)[0], *np.zeros(len(self.zeroed))])
        if self.torque_zeros:
            local[len(self.shared) + self.own.index(TORQUE_ZERO)] = self.torque_zeros[run]
        return local

    @cached_property
    def first(self) -> tuple[Outcome, ...]:
        """Every stretch where the unknowns begin, with slopes.

        Raises
        ------
        ResultError : the simulation is not finite.
        """
        if self._plain is None:
            return self.each(lambda k: self.simulate(k, self.start(k)))
        before, at = self._plain.first, len(self._plain.shared)
        assert self._adding.outputs  # made before threads ask for it
        added = self.each(self._added)
        return tuple(
            Outcome(o.values, {n: np.hstack([s[:, :at], new[n], s[:, at:]]) for n, s in o.slopes.items()})
            for o, new in zip(before, added, strict=True)
        )

    def _added(self, run: int) -> dict[str, Array]:
        """The derivatives of one stretch to what is added."""
        start = np.array([u.start for u in self.extra])
        without, slopes = true_readings(self._adding(self.drives[run], start), self.stretches[run])
        for i, size in self._secants.items():
            own = start + size * (np.arange(start.size) == i)
            with_it = self._adding(self.drives[run], own, sensitivities=False)
            for n, value in true_readings(with_it, self.stretches[run])[0].items():
                slopes[n][:, i] = (value - without[n]) / size
        return slopes

    @cached_property
    def _secants(self) -> Mapping[int, float]:
        """Of what is added and has no slope at nothing: its place, and the size over which its trace is taken."""
        places = {u.name: i for i, u in enumerate(self.extra)}
        sizes = {next(iter(e.unknowns)): e.probes[len(e.probes) // 3] for e in self.effects if e.probes}
        return {places[n]: size for n, size in sizes.items() if n in places}

    @cached_property
    def shaken(self) -> tuple[Mapping[str, Array], ...]:
        """What more noise of the torque sensor's own size does to the outputs of every stretch.

        Of the car as it is believed to be, whatever is added: fits with one cause or another are then weighed alike.
        """
        bare = self.bare
        if bare is not self:
            return bare.shaken
        assert self._shaken_drives  # made before threads ask for them
        seen = self.each(lambda k: self.simulate(k, self.start(k), slopes=False, shaken=True))
        return tuple({n: a.values[n] - b.values[n] for n in b.values} for a, b in zip(seen, self.first, strict=True))

    def each(self, work: Callable[[int], T]) -> tuple[T, ...]:
        """The work on every stretch, several at once where that can be, the longest first."""
        count = len(self.stretches)
        workers = min(count, os.cpu_count() or 1) if self._simulator.at_once else 1
        if workers < 2:
            return tuple(work(k) for k in range(count))
        order = sorted(range(count), key=lambda k: -self.stretches[k].time.size)
        assert self.drives  # made before threads ask for them
        with ThreadPoolExecutor(workers) as pool:
            done = dict(zip(order, pool.map(work, order), strict=True))
        return tuple(done[k] for k in range(count))

    def theta(self) -> Array:
        """(shared,) the unknowns where they begin."""
        begun = [self.at.get(n, self.beliefs.values[n]) for n in self.beliefs.names]
        return np.array([*begun, *np.zeros(len(self.instruments)), *(u.start for u in self.extra)])

    def begun_at(self, values: Mapping[str, float]) -> Trial:
        """The trial with its believed parameters begun at these values, as far as they are possible and not absurd."""
        return replace(self, at=near_belief(self.beliefs, values))

    def begun(self, run: int) -> tuple[float, float]:
        """Start speed of a stretch and its standard deviation."""
        value, std = self.stretches[run].start
        return (0.0, AT_REST) if abs(value) < REST and std < REST else (value, max(std, 1e-3))

    def simulate(self, run: int, theta: Array, slopes: bool = True, shaken: bool = False) -> Outcome:
        """One stretch at its local unknowns (shared, start speed, zeros), ``shaken`` by more noise in its torques.

        Raises
        ------
        ResultError : the simulation is not finite.
        """
        drive = (self._shaken_drives if shaken else self.drives)[run]
        k, m, steady = len(self.beliefs.names), len(self.instruments), len(self.shared)
        seen = self._simulator(drive, theta[self._moving], sensitivities=slopes)
        values, derivatives = true_readings(seen, self.stretches[run])
        for name in values:
            of_gains, of_zeros = theta[k : k + m], theta[steady + 1 + self.sensors.driving :]
            added, columns = self.sensors.read(name, values[name], of_gains, of_zeros)
            if slopes:
                moved = derivatives[name]
                derivatives[name] = np.hstack([moved[:, :k], columns[0], moved[:, k:], columns[1]])
            values[name] = added
        return Outcome(values, derivatives)

    def unknowns(self) -> tuple[tuple[Unknown, ...], dict[str, Array]]:
        """Everything sought, with what is known of it; and each stretch's own starts."""
        found = [replace(u, start=self.at.get(u.name, u.start)) for u in believed(self.beliefs)]
        start = Unknown(START, 0.0, -10.0, 160.0, "m/s", per_run=True, nuisance=True)
        begun = {START: np.array([self.begun(k)[0] for k in range(len(self.stretches))])}
        if self.torque_zeros:
            begun[TORQUE_ZERO] = np.array(self.torque_zeros)
        return (*found, *self.sensors.gain_unknowns(), *self.extra, start, *self.sensors.zero_unknowns()), begun

    def with_wind(self, variance: float) -> Trial:
        return replace(self, wind_variance=variance)


def remembered(trial: Trial) -> Trial:
    """The first that was made of the trials that drive as this one does: what it has simulated is at hand."""
    return _shelf(trial.drives_alike).setdefault("trial", trial)


@lru_cache(maxsize=4)
def _shelf(alike: Hashable) -> dict[str, Trial]:
    """Where the last ones stand: as believed, in long and in short steps, as the baseline's fit has it, and without
    the play that is believed."""
    return {}
