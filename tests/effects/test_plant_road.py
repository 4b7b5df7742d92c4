"""A cause of size q in the truth plant is a cause of size q in the road load: the same change of the same runs."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant import coast
from tests.plant.coast_motion import Car, Plan, road_profile
from tests.plant.sensors import Sensor
from tests.plant.vehicle import Vehicle, random_vehicle
from vdyn_cli.effects import Effect, catalog
from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.physics.models.road_load import road_load

EFFECTS = {effect.name: effect for effect in catalog()}
SEED = 11
VEHICLE = random_vehicle(SEED)
COAST = coast.QUIET.but(runs=2, start_speed=36.0, end_speed=2.0, temperatures=(10.0, 25.0))
DRIVEN = coast.QUIET.but(runs=2, powered=60.0)
COASTING = {
    "extra_drag_area": 0.1,
    "headwind": 2.0,
    "road_grade": 0.002,
    "speed_dependent_rolling": 1e-4,
    "tire_warmup": 0.2,
    "temperature_rolling": 8.6e-3,
    "brake_drag": 40.0,
    "brake_drag_fading": 60.0,
    "driveline_drag": 40.0,
    "rotating_mass": 60.0,
    "mass_error": 0.03,
    "speed_scale": 0.02,
    "speed_delay": 0.2,
}
POWERED = {"wheel_radius": 0.02, "mass_error": 0.03, "rotating_mass": 60.0}
FAULTS = {"torque_gain": 0.03, "torque_offset": 3.0, "torque_drift": 0.05, "torque_delay": 0.1}
ROAD = 1200.0  # m, driven by every run
SLOWEST = 0.5  # m/s: the program's car only rolls forward, so that its friction does not turn at rest
WITHIN = 0.02  # of the change: the plant steps by 0.1 s and turns its resistance over another speed


def car(vehicle: Vehicle, day: coast.Day) -> dict[str, float]:
    names = ("mass", "rotating_mass", "rolling_resistance", "drag_area", "gear_ratio", "wheel_radius")
    values = {name: float(getattr(vehicle, name)) for name in names}
    return {**values, "air_density": day.air_density, "rolling_speed": 0.0, "wind_variance": 0.0}


def true_torque(plan: Plan, day: coast.Day, run: int, time: np.ndarray) -> np.ndarray:
    return Car(VEHICLE, day.air_density, plan, {}).torque(time)[:, run]


def simulate(
    plan: Plan,
    day: coast.Day,
    values: dict[str, float],
    effects: tuple[Effect, ...] = (),
    run: int = 0,
    unknowns: tuple[str, ...] = (),
    torque: np.ndarray | None = None,
) -> Simulated:
    """One run by the program; ``values`` may hold more than the model has, and are where the unknowns start."""
    model = road_load("torque" if day.powered else "coasting", located=True)
    own = {name for effect in effects for name in effect.unknowns}
    names = {*model.parameters, *own} & {*values, "driveline_efficiency", "recuperation_loss"}
    parameters = {name: values.get(name, 1.0) for name in names}
    time, heading = plan.samples[run], float(plan.heading[run])
    inputs = {"grade": 0.0, "wind_speed": 0.0, "elapsed": plan.start[run] + time}
    if day.powered:
        inputs["drive_torque"] = true_torque(plan, day, run, time) if torque is None else torque
    true = coast.noise_free(VEHICLE, plan, day, {})[run]
    along = np.r_[0.0, np.cumsum(np.diff(time) * (true[1:] + true[:-1]) / 2)]
    inputs["position"] = heading * float(plan.position[run]) + along
    start = {"speed": float(plan.speed[run])}
    context = {"heading": heading, "temperature": 273.15 + float(plan.temperature[run])}
    context |= {"road_begin": 0.0, "road_end": ROAD}
    simulator = Simulator(model, parameters, unknowns, effects)
    return simulator(Drive(time, inputs, start, {}, context), [parameters.get(name, 0.0) for name in unknowns])


def changes(name: str, size: float, day: coast.Day) -> list[tuple[np.ndarray, np.ndarray]]:
    """What the effect changes in each run's speed while the car rolls: in the plant, and in the program."""
    plan = coast.plan(VEHICLE, SEED, day)
    effect, values = EFFECTS[name], car(VEHICLE, day)
    sizes = {**effect.nominal, next(iter(effect.unknowns)): size}
    true = [coast.noise_free(VEHICLE, plan, day, hidden) for hidden in ({name: size}, {})]
    found = []
    for run in range(day.runs):
        mine = [simulate(plan, day, {**values, **sizes}, (effect,), run), simulate(plan, day, values, (), run)]
        rolls = np.minimum(true[0][run], true[1][run]) > SLOWEST
        changed = mine[0].outputs["speed"] - mine[1].outputs["speed"]
        found.append(((true[0][run] - true[1][run])[rolls], changed[rolls]))
    return found


@pytest.mark.parametrize("name", COASTING)
def test_a_coast_changes_as_in_the_plant(name):
    for true, mine in changes(name, COASTING[name], COAST):
        assert mine == pytest.approx(true, abs=WITHIN * np.abs(true).max())


@pytest.mark.parametrize("name", POWERED)
def test_a_drive_changes_as_in_the_plant(name):
    for true, mine in changes(name, POWERED[name], DRIVEN):
        assert mine == pytest.approx(true, abs=WITHIN * np.abs(true).max())


@pytest.mark.parametrize("faulty", [*((name,) for name in FAULTS), tuple(FAULTS)], ids=" ".join)
def test_a_faulty_torque_log_with_its_fault_known_drives_the_car_as_the_true_torque_does(faulty):
    plan, values = coast.plan(VEHICLE, SEED, DRIVEN), car(VEHICLE, DRIVEN)
    q = {name: FAULTS[name] if name in faulty else 0.0 for name in FAULTS}
    sensed = plan.samples[0] - q["torque_delay"]
    drift = q["torque_drift"] * (sensed - plan.samples[0][0])
    log = (1.0 + q["torque_gain"]) * true_torque(plan, DRIVEN, 0, sensed) + q["torque_offset"] + drift
    plain = simulate(plan, DRIVEN, values).outputs["speed"]
    told = simulate(plan, DRIVEN, {**values, **q}, tuple(EFFECTS[name] for name in faulty), torque=log)
    assert told.outputs["speed"] == pytest.approx(plain, abs=1e-3)
    assert np.abs(simulate(plan, DRIVEN, values, torque=log).outputs["speed"] - plain).max() > 0.05


def test_a_road_that_rises_and_falls_is_followed_both_ways():
    """Twelve hats can't follow the plant's shortest dip, which is half as long as their distance."""
    size, profile = 0.003, EFFECTS["grade_profile"]
    plan, values = coast.plan(VEHICLE, SEED, coast.DAY), car(VEHICLE, coast.DAY)
    quiet = coast.QUIET.but(start_speed=coast.DAY.start_speed, end_speed=coast.DAY.end_speed)
    names = tuple(profile.unknowns)
    seen, true = [], []
    for run in range(4):
        hidden = [coast.noise_free(VEHICLE, plan, quiet, q)[run] for q in ({"grade_profile": size}, {})]
        true.append(hidden[0] - hidden[1])
        seen.append(simulate(plan, quiet, values, (profile,), run, names).sensitivities["speed"])
    change = np.concatenate(true)
    slopes = np.linalg.lstsq(np.vstack(seen), change)[0]
    left = np.linalg.norm(np.vstack(seen) @ slopes - change) / np.linalg.norm(change)
    assert left < 0.4
    along = np.linspace(0.0, ROAD, len(names))
    assert np.corrcoef(slopes[1:8], size * road_profile(along)[1:8])[0, 1] > 0.5


def test_the_accelerometers_faults_read_as_in_the_plant():
    day = COAST.but(acceleration=Sensor())
    names, q = ("accelerometer_tilt", "accelerometer_offset"), {"accelerometer_tilt": 0.02, "accelerometer_offset": 0.1}
    values = car(VEHICLE, day) | {"accelerometer_zero": 0.0, "accelerometer_scale": 0.0, "road_slope": 0.0}
    run = coast.campaign(VEHICLE, SEED, day, q)[0]
    plan, model = coast.plan(VEHICLE, SEED, day, q), road_load(accelerometer=True)
    inputs = {"grade": 0.0, "wind_speed": 0.0, "elapsed": 0.0, "speed": run.record["GPS Speed [km/h]"] / 3.6}
    context = {"heading": 1.0, "temperature": 293.15}
    drive = Drive(plan.samples[0], inputs, {"speed": float(plan.speed[0])}, {}, context)
    parameters = {name: values[name] for name in model.parameters} | q
    read = Simulator(model, parameters, (), tuple(EFFECTS[name] for name in names))(drive).outputs["acceleration"]
    assert read[1:-1] == pytest.approx(run.record["Long Accel [m/s^2]"][1:-1], abs=2e-3)


def test_a_filtered_speed_reads_like_one_behind_a_pole_without_its_delay():
    """The law filters with the time constant of its estimate; it has no transient where a drive begins."""
    model, time, tau = road_load("torque"), np.arange(0.0, 20.0, 0.01), 0.3
    values = car(VEHICLE, DRIVEN) | {"driveline_efficiency": 1.0, "recuperation_loss": 0.0, "speed_filter": tau**2}
    inputs = {"grade": 0.0, "wind_speed": 0.0, "elapsed": 0.0, "drive_torque": 150.0 + 100.0 * np.cos(1.5 * time)}
    drive = Drive(time, inputs, {"speed": 8.0}, {}, {"heading": 1.0, "temperature": 293.15})
    parameters = {name: values[name] for name in model.parameters}
    true = Simulator(model, parameters, (), ())(drive).outputs["speed"]
    read = Simulator(model, parameters | {"speed_filter": tau**2}, (), (EFFECTS["speed_filter"],))(drive).outputs[
        "speed"
    ]
    kept = np.exp(-0.01 / tau)
    behind = np.empty_like(true)
    behind[0] = true[0] - tau * (true[1] - true[0]) / 0.01
    for k in range(1, time.size):
        behind[k] = kept * behind[k - 1] + (1.0 - kept) * (true[k] + true[k - 1]) / 2
    expected = np.interp(time + tau, time, behind) - true
    inside = time < 20.0 - tau
    assert (read - true)[inside] == pytest.approx(expected[inside], abs=0.05 * np.abs(expected[inside]).max())
    assert read[0] - true[0] == pytest.approx(expected[0], abs=1e-3)


def test_a_scaled_speed_is_scaled_back_where_it_drives_the_model():
    """With an accelerometer the resistances see the measured speed: a wrong scale in the log must not touch them."""
    values = car(VEHICLE, COAST) | {"accelerometer_zero": 0.0, "accelerometer_scale": 0.0, "road_slope": 0.0}
    model, time = road_load(accelerometer=True), np.linspace(0.0, 20.0, 201)
    speed, found = np.linspace(30.0, 20.0, time.size), []
    for scale in (0.0, 0.02):
        inputs = {"grade": 0.0, "wind_speed": 0.0, "elapsed": 0.0, "speed": (1.0 + scale) * speed}
        drive = Drive(time, inputs, {"speed": 30.0}, {}, {"heading": 1.0, "temperature": 293.15})
        parameters = {name: values[name] for name in model.parameters} | {"speed_scale_error": scale}
        found.append(Simulator(model, parameters, (), (EFFECTS["speed_scale"],))(drive).outputs)
    assert found[1]["acceleration"] == pytest.approx(found[0]["acceleration"], rel=1e-12)
    assert found[1]["speed"] == pytest.approx(1.02 * found[0]["speed"], rel=1e-12)


def test_a_speed_that_reads_too_high_makes_the_hills_of_an_elevation_too_flat():
    values = car(VEHICLE, DRIVEN) | {"driveline_efficiency": 1.0, "recuperation_loss": 0.0, "speed_scale_error": 0.03}
    model, time = road_load("torque", graded="elevation"), np.linspace(0.0, 20.0, 201)
    read = []
    for effects, flat in ((), 1.0), ((EFFECTS["speed_scale"],), 1.03):
        inputs = {"grade": 0.02 * np.sin(time) / flat, "wind_speed": 0.0, "elapsed": 0.0, "drive_torque": 150.0}
        drive = Drive(time, inputs, {"speed": 15.0}, {}, {"heading": 1.0, "temperature": 293.15})
        parameters = {name: values[name] for name in (*model.parameters, *(n for e in effects for n in e.unknowns))}
        read.append(Simulator(model, parameters, (), effects)(drive).outputs["speed"])
    assert read[1] == pytest.approx(1.03 * read[0], rel=1e-9)
