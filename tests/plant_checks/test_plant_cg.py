"""The truth plant's accelerate-and-brake runs: balances, signs, an independent integration, effects, noise, bounds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, solve_ivp

from tests.plant import cg
from tests.plant.cg_motion import EFFECTS, Body, Ride
from tests.plant.sensors import Array
from tests.plant.vehicle import AIR_DENSITY, GRAVITY, REFERENCE, Vehicle, random_vehicle

pytestmark = pytest.mark.slow  # checks the plant, not the program

RUN = cg.manoeuvres(1, 1)[0]
TRUE = RUN.ride(REFERENCE)
FRONT, REAR = ("FL Fz [N]", "FR Fz [N]"), ("RL Fz [N]", "RR Fz [N]")
SPIN = 4 * REFERENCE.wheel_inertia / REFERENCE.wheel_radius


def read(effects: dict[str, float], run: cg.Manoeuvre = RUN) -> dict[str, Array]:
    return cg.noise_free(REFERENCE, [run], effects)[0]


def axles(log: dict[str, Array]) -> tuple[Array, Array]:
    return sum(log[h] for h in FRONT), sum(log[h] for h in REAR)  # type: ignore[return-value]


def unbalanced(car: Vehicle, ride: Ride, slope: float = 0.0) -> Array:
    """What the load transfer about the rear contact leaves over, N m."""
    climb = car.mass * GRAVITY * np.sin(slope) * car.cg_height
    spin = 4 * car.wheel_inertia / car.wheel_radius
    return (
        car.wheelbase * ride.front
        - car.cg_to_rear * (ride.front + ride.rear)
        + car.mass * car.cg_height * ride.acceleration
        + spin * (ride.acceleration + ride.sliding_rate)
        + ride.drag * car.drag_height
        + climb
        - car.pitch_inertia * ride.pitch_acceleration
        + rolling_moment(car) * np.cos(slope)
    )


def rolling_moment(car: Vehicle) -> float:
    """What rolling resistance takes from the wheels, N m."""
    return car.rolling_resistance * car.wheel_radius * car.mass * GRAVITY


def test_at_rest_the_axles_carry_the_weight() -> None:
    assert TRUE.front[0] == pytest.approx(REFERENCE.front_load, rel=3e-3)  # the run begins rolling: drag is there
    assert TRUE.front[0] + TRUE.rear[0] == pytest.approx(REFERENCE.mass * GRAVITY, rel=1e-9)
    assert REFERENCE.front_load * REFERENCE.wheelbase == pytest.approx(REFERENCE.mass * GRAVITY * 1.45)


@pytest.mark.parametrize("seed", range(5))
def test_moments_and_forces_balance_at_every_instant(seed: int) -> None:
    car = random_vehicle(seed)
    ride = cg.manoeuvres(seed, 1)[0].ride(car)
    assert np.max(np.abs(unbalanced(car, ride))) < 1e-6
    heave = (ride.front + ride.rear) / car.mass - GRAVITY
    assert np.allclose(heave, ride.heave_acceleration, atol=1e-9)


def test_the_sliding_speed_is_that_of_the_force_with_a_relaxation_length() -> None:
    clock = np.arange(0.0, 10.0, 5e-3)
    ride = Body(REFERENCE, RUN.pedals, 11.0).at(clock)
    slip = ride.acceleration / (GRAVITY * REFERENCE.tire_longitudinal_stiffness)
    wanted = ride.speed * slip + REFERENCE.tire_relaxation_length * np.gradient(slip, clock)
    slid = cumulative_trapezoid(ride.sliding_rate, clock, initial=0.0)
    assert np.ptp(slid - wanted) < 0.03 * np.ptp(wanted)


def test_throttle_lifts_the_nose_and_brakes_dip_it() -> None:
    hard, brake = TRUE.acceleration > 2.0, TRUE.acceleration < -4.0
    assert TRUE.pitch[hard].mean() > np.radians(0.3)
    assert TRUE.pitch[brake].mean() < np.radians(-0.5)
    assert TRUE.front[hard].mean() < REFERENCE.front_load < TRUE.front[brake].mean()


def test_steady_acceleration_transfers_the_textbook_load() -> None:
    knots, wanted = np.array([0.0, 1.0, 10.0]), np.array([0.0, 2.0, 2.0])
    body = Body(REFERENCE, cg.Pedals(0.5, knots, wanted, 1.0), 8.0)
    ride = body.at(np.array([4.0]))
    moment = (REFERENCE.mass * 0.61 + SPIN) * ride.acceleration + ride.drag * REFERENCE.drag_height
    moment += rolling_moment(REFERENCE)
    assert ride.front[0] == pytest.approx(REFERENCE.front_load - moment[0] / 2.7, abs=0.5)


def test_pitch_rate_and_its_slope_belong_to_the_pitch() -> None:
    clock = np.arange(0.0, 20.0, 1e-3)
    ride = Body(REFERENCE, RUN.pedals, 20.0).at(clock)
    assert np.max(np.abs(np.gradient(ride.pitch, clock) - ride.pitch_rate)[1:-1]) < 2e-5
    assert np.max(np.abs(np.gradient(ride.pitch_rate, clock) - ride.pitch_acceleration)[1:-1]) < 0.02


def test_an_independent_integration_agrees() -> None:
    car = random_vehicle(3)
    kf, kr = car.suspension_stiffness_front, car.suspension_stiffness_rear
    cf, cr, lf, lr = car.suspension_damping_front, car.suspension_damping_rear, car.cg_to_front, car.cg_to_rear
    air = 0.5 * AIR_DENSITY * car.drag_area

    def rates(t: float, x: Array) -> list[float]:
        v, z, th, dz, dth = x
        a = float(np.interp(t, RUN.pedals.knots, RUN.pedals.wanted)) - air * v * v / car.mass
        front = -kf * (z + lf * th) - cf * (dz + lf * dth)
        rear = -kr * (z - lr * th) - cr * (dz - lr * dth)
        spin = 4 * car.wheel_inertia / car.wheel_radius * (a + float(np.interp(t, begin.clock, begin.slide)))
        moment = lf * front - lr * rear + car.cg_height * (car.mass * a + air * v * v)
        moment += air * v * v * (car.drag_height - car.cg_height) + spin + rolling_moment(car)
        return [a, dz, dth, (front + rear) / car.mass, moment / car.pitch_inertia]

    ride = RUN.ride(car)
    begin = Body(car, RUN.pedals, 10.0)
    start = [begin.speed[0], *begin.state[0]]
    path = solve_ivp(
        rates, (0.0, 10.0), start, t_eval=RUN.times[RUN.times < 10.0], rtol=1e-9, atol=1e-10, max_step=0.01
    )
    n = path.t.size
    assert np.max(np.abs(path.y[0] - ride.speed[:n])) < 1e-4
    assert np.max(np.abs(path.y[2] - ride.pitch[:n])) < 1e-6
    assert np.max(np.abs(path.y[4] - ride.pitch_rate[:n])) < 2e-5


def test_the_antenna_feels_the_pitching() -> None:
    lever = REFERENCE.antenna_height - REFERENCE.cg_height
    assert np.allclose(read({})["Antenna Accel [m/s^2]"], TRUE.acceleration - lever * TRUE.pitch_acceleration)


def test_sensor_effects() -> None:
    plain = read({})
    level = read({"accelerometer_tilt": 0.02, "accelerometer_offset": 0.1})
    shift = level["Antenna Accel [m/s^2]"] - plain["Antenna Accel [m/s^2]"]
    assert np.allclose(shift, 0.1 + GRAVITY * np.sin(0.02))
    front, rear = axles(plain)
    gain = axles(read({"wheel_force_gain": 0.01}))
    assert np.allclose(gain[0], 1.01 * front)
    assert np.allclose(gain[1], 1.01 * rear)
    assert np.allclose(axles(read({"wheel_force_gain_front": 0.01}))[0], 1.01 * front)
    assert np.allclose(axles(read({"wheel_force_gain_front": 0.01}))[1], rear)
    assert np.allclose(read({"pitch_rate_gain": 0.03})["Pitch Rate [deg/s]"], 1.03 * plain["Pitch Rate [deg/s]"])
    late = axles(read({"clock_offset": 0.02}))[0]
    assert np.max(np.abs(late[100:] - np.interp(RUN.times - 0.02, RUN.times, front)[100:])) < 20.0
    crossed = axles(read({"load_crosstalk": 0.01}))
    assert np.allclose(crossed[0] + crossed[1] - front - rear, 0.01 * TRUE.force)


def test_grade_and_lift_act_on_the_loads() -> None:
    hill = RUN.ride(REFERENCE, {"road_grade": 0.02})
    assert np.max(np.abs(unbalanced(REFERENCE, hill, np.arctan(0.02)))) < 1e-6
    assert (hill.front + hill.rear).mean() == pytest.approx(
        (TRUE.front + TRUE.rear).mean() * np.cos(np.arctan(0.02)), rel=1e-3
    )
    downhill = REFERENCE.mass * GRAVITY * 0.02 * 0.61 / 2.7
    assert np.mean(hill.front - TRUE.front) == pytest.approx(-downhill, rel=0.1)
    back = cg.manoeuvres(1, 2)[1]
    assert np.mean(back.ride(REFERENCE, {"road_grade": 0.02}).front - back.ride(REFERENCE).front) == pytest.approx(
        downhill, rel=0.1
    )
    lifted = RUN.ride(REFERENCE, {"aero_lift_front": 0.3})
    expected = 0.5 * AIR_DENSITY * 0.3 * TRUE.speed**2
    assert np.mean(lifted.front - TRUE.front) == pytest.approx(-expected.mean(), rel=0.03)
    assert np.mean(lifted.rear - TRUE.rear) == pytest.approx(0.0, abs=2.0)


def test_bouncing_axles_and_a_low_pitch_axis_disturb_the_balance() -> None:
    bouncing = RUN.ride(REFERENCE, {"unsprung_mass": 75.0})
    assert 5.0 < unbalanced(REFERENCE, bouncing).std() < 100.0
    shifted = RUN.ride(REFERENCE, {"pitch_axis": 0.3})
    left = unbalanced(REFERENCE, shifted)
    # The center of gravity moves back by 0.3 m x pitch: the front loses that much moment.
    assert np.allclose(left, -REFERENCE.mass * GRAVITY * 0.3 * shifted.pitch, atol=1e-6)


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_effect_of_no_size_is_nothing(effect: str) -> None:
    plain, zero = read({}), read({effect: 0.0})
    assert all(np.array_equal(plain[h], zero[h]) for h in plain)


def test_an_unknown_effect_is_refused() -> None:
    with pytest.raises(ValueError, match="no effect"):
        read({"tailwind": 1.0})


def test_the_noise_of_the_balance_is_as_the_bound_takes_it() -> None:
    lever = REFERENCE.antenna_height - REFERENCE.cg_height
    per_acceleration = REFERENCE.mass * REFERENCE.cg_height + SPIN
    band = cg._noise_band(REFERENCE, RUN, per_acceleration, lever)
    rng, n = np.random.default_rng(4), RUN.times.size
    left = []
    for _ in range(300):
        front, rear = (2**0.5 * cg.LOAD.noise * rng.standard_normal(n) for _ in range(2))
        push, rate = (s.noise * rng.standard_normal(n) for s in (cg.ACCELERATION, cg.PITCH_RATE))
        slope = (rate[2:] - rate[:-2]) / (RUN.times[2:] - RUN.times[:-2])
        balance = REFERENCE.wheelbase * front - REFERENCE.cg_to_rear * (front + rear)
        balance = (balance + per_acceleration * push)[1:-1]
        left.append(balance + (per_acceleration * lever - REFERENCE.pitch_inertia) * slope)
    noise = np.array(left)
    assert np.mean(noise**2) == pytest.approx(band[0].mean(), rel=0.01)
    assert np.mean(noise[:, 2:] * noise[:, :-2]) == pytest.approx(band[2, :-2].mean(), rel=0.05)


def test_the_bound_is_tight_enough_to_be_worth_driving() -> None:
    bound, truth = cg.information(REFERENCE, 1).bound(), cg.truth(REFERENCE)
    assert bound["cg_height"] / truth["cg_height"] < 1e-3
    assert bound["cg_to_rear"] / truth["cg_to_rear"] < 1e-3
    assert bound["pitch_inertia"] / truth["pitch_inertia"] < 3e-3
    more = cg.information(REFERENCE, 1, count=8).bound()
    assert more["cg_height"] < 0.8 * bound["cg_height"]


def test_every_car_stays_on_its_wheels_and_rolling() -> None:
    for seed in range(10):
        for run in cg.campaign(random_vehicle(seed), seed):
            assert np.all(np.diff(run.record["Time [s]"]) > 0)
            assert run.record["Speed [km/h]"].min() > 5.0
            assert min(run.record[h].min() for h in FRONT + REAR) > 300.0
