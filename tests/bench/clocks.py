"""Delay and drift of two loggers from tied channels: ``python -m tests.bench.clocks [draws] [first seed]``.

For each pair: standard errors, how often delay and drift lie within two of them, and refusals. Writes clocks.md.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.plant.two_loggers import TwoLoggers, two_loggers
from tests.plant.vehicle import Vehicle, random_vehicle
from tests.steps.cg.test_cg import SPEC, known
from tests.steps.cg.test_cg import logs as logs_of_launches
from vdyn_cli.io.clocks.align import merge
from vdyn_cli.io.clocks.clock_estimate import clock_difference
from vdyn_cli.io.clocks.tied_channels import ChannelTie, tie_of
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.errors import InputError, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.cg.step import STEP

PAIRS = (("speed", "speed"), ("wheel_speed", "speed"), ("speed", "acceleration"), ("position", "speed"))
SEEDS = 7000  # of the published table


def logs(drive: TwoLoggers, first: str, second: str) -> tuple[Log, Log]:
    """The log of one channel of each logger."""
    t, x = drive.first[first]
    s, y = drive.second[second]
    return Log("bus", t, {first: x}), Log("box", s, {second: y})


def errors(drive: TwoLoggers, found: ClockDifference) -> tuple[float, float]:
    """Errors of delay and drift, in standard errors."""
    delay = (found.delay - drive.delay - drive.drift * found.at) / found.delay_std
    return delay, (found.drift - drive.drift) / found.drift_std


def tie(first: str, second: str) -> ChannelTie:
    """The tie of two channels of the table."""
    found = tie_of(first, second)
    assert found is not None
    return found


def table(draws: int, seed: int) -> list[str]:
    """The rows of the table."""
    lines = [
        "| pair | delay s.e., ms | within 2 s.e. | drift s.e., ppm | within 2 s.e. | refused |",
        "|---|" + "---|" * 5,
    ]
    for first, second in PAIRS:
        got, refused = [], 0
        for k in range(draws):
            drive = two_loggers(np.random.default_rng(seed + k))
            try:
                found = clock_difference(*logs(drive, first, second), tie(first, second))
            except InputError:
                refused += 1
                continue
            got.append((*errors(drive, found), found.delay_std, found.drift_std))
        delay, drift, std, drift_std = np.transpose(got)
        shares = [f"{np.mean(np.abs(e) <= 2.0):.0%}" for e in (delay, drift)]
        cells = (f"{1e3 * np.median(std):.1f}", shares[0], f"{1e6 * np.median(drift_std):.0f}", shares[1], str(refused))
        lines.append(f"| {first} ~ {second} | {' | '.join(cells)} |")
        print(lines[-1], flush=True)
    return lines


def estimated(data: Sequence[Log], vehicle: Vehicle) -> Parameters:
    """The parameters of the launches; none where the fit is refused."""
    try:
        return STEP.estimate(SPEC, tuple(data), known(vehicle)).parameters
    except ResultError:
        return Parameters()


def answers(draws: int, seed: int) -> list[str]:
    """Center of gravity by loads of one logger, speed of both, acceleration and pitch rate of the other."""
    inside, late, names = [], [], ("cg_height", "cg_to_rear", "pitch_inertia")
    for k in range(draws):
        rng = np.random.default_rng([seed, k])
        vehicle = random_vehicle(seed + k)
        whole, parts, alone = logs_of_launches(vehicle, seed + k), [], []
        for one in whole:
            delay, drift = (rng.uniform(*r) * rng.choice([-1.0, 1.0]) for r in ((0.02, 0.15), (20e-6, 200e-6)))
            car = Log(one.name, one.time, {n: one[n] for n in ("front_load", "rear_load", "speed")})
            box = Log("box", one.time * (1.0 + drift) + delay, {n: one[n] for n in ("acceleration", "pitch_rate")})
            box = box.with_channels(speed=one["speed"] + rng.normal(0.0, 0.03, one.time.size))
            parts.append(merge(car, [box])[0])
            alone.append(
                car.with_channels(**{n: np.interp(one.time, box.time, box[n]) for n in ("acceleration", "pitch_rate")})
            )
        clean = estimated(whole, vehicle)
        for data, counted in ((parts, inside), (alone, late)):
            found = estimated(data, vehicle)
            ends = [(found[n].value, *clean[n].interval95) for n in names if n in found]
            counted.append(len(ends) == len(names) and all(low <= value <= high for value, low, high in ends))
    text = f"Answers of `cg` within the clean answer's interval: {np.mean(inside):.0%} with the clocks' correction, "
    text += f"{np.mean(late):.0%} without (delay 20 to 150 ms, drift 20 to 200 ppm)."
    print(text)
    return ["", text]


def main(arguments: list[str]) -> int:
    draws = int(arguments[0]) if arguments else 30
    seed = int(arguments[1]) if len(arguments) > 1 else SEEDS
    lines = [*table(draws, seed), *answers(draws, seed)]
    if seed == SEEDS:
        head = f"# Clocks of two loggers\n\n`python -m tests.bench.clocks`: {draws} drives of 10 minutes, delay 20 to "
        head += "150 ms, drift 20 to 200 ppm.\n\n"
        Path(__file__).with_name("clocks.md").write_text(head + "\n".join(lines) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
