"""The energy of a simulated vehicle, from its states: kinetic, stored, put in and lost, written anew."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.simulate import Simulated

Array = NDArray[np.float64]
G = 9.80665
HELD = 0.8e-3  # s by which the model's side gears lag
PLACES = {"fl": (1, 1), "fr": (1, -1), "rl": (-1, 1), "rr": (-1, -1)}


class Account:
    """Energies (J) and powers (W) at every sample of a drive on a road of height zero without lift-off."""

    def __init__(self, run: Simulated, p: Mapping[str, float], drive: Array, brake: Array, grade: float) -> None:
        self.run, self.p, self.x = run, p, run.states
        self.slope = np.arctan(grade)
        unsprung = p["unsprung_mass_front"] + p["unsprung_mass_rear"]
        self.sprung = p["mass"] - unsprung
        self.behind = (p["mass"] * p["cg_to_front"] - p["unsprung_mass_rear"] * p["wheelbase"]) / self.sprung
        x = self.x
        self.kinetic = 0.5 * p["mass"] * (x["speed"] ** 2 + x["lateral_speed"] ** 2)
        self.kinetic += 0.5 * self.sprung * x["heave_rate"] ** 2
        for way in ("pitch", "roll", "yaw"):
            self.kinetic += 0.5 * p[f"{way}_inertia"] * x[f"{way}_rate"] ** 2
        lightness = G * (1.0 - np.cos(self.slope))
        self.stored = -self.sprung * lightness * x["heave"]
        self.put_in = -p["mass"] * G * np.sin(self.slope) * x["speed"]
        self.lost = np.zeros(run.time.size)
        self.loads: dict[str, Array] = {}
        self.forward: dict[str, Array] = {}
        for at, (end, side) in PLACES.items():
            self._corner(at, "front" if end > 0 else "rear", side, brake, lightness)
        self._driveline(drive * p["gear_ratio"])
        air = 0.5 * p["air_density"] * p["drag_area"] * x["speed"] * np.abs(x["speed"])
        self.lost += air * (x["speed"] - (p["drag_height"] - p["cg_height"]) * x["pitch_rate"])

    def _corner(self, at: str, axle: str, side: int, brake: Array, lightness: float) -> None:
        p, x = self.p, self.x
        ahead = p["cg_to_front"] - (0.0 if axle == "front" else p["wheelbase"])
        arm = self.behind - (0.0 if axle == "front" else p["wheelbase"])
        across = side * p[f"track_{axle}"] / 2
        mass = p[f"unsprung_mass_{axle}"] / 2
        height, rise = x[f"wheel_height_{at}"], x[f"wheel_rate_{at}"]
        stroke = x["heave"] + arm * x["pitch"] + across * x["roll"] - height
        stroke_rate = x["heave_rate"] + arm * x["pitch_rate"] + across * x["roll_rate"] - rise
        stiffness, vertical = p[f"suspension_stiffness_{axle}"] / 2, p["tire_vertical_stiffness"] / 2
        self.kinetic += 0.5 * mass * rise**2 + 0.5 * p["wheel_inertia"] * x[f"wheel_speed_{at}"] ** 2
        self.stored += 0.5 * stiffness * stroke**2 + 0.5 * vertical * height**2 - mass * lightness * height
        self.lost += p[f"suspension_damping_{axle}"] / 2 * stroke_rate**2
        self.lost += p["tire_vertical_damping"] / 2 * rise**2
        other = p["wheelbase"] - p["cg_to_front"] if axle == "front" else p["cg_to_front"]
        static = p["mass"] * G * other / p["wheelbase"] / 2
        load = static - vertical * height - p["tire_vertical_damping"] / 2 * rise
        assert load.min() > 0.0
        self.loads[at] = load
        self._contact(at, load, static, ahead, across)
        self._friction(at, load, brake * (p["brake_share_front"] if axle == "front" else 1 - p["brake_share_front"]))

    def _contact(self, at: str, load: Array, static: float, ahead: float, across: float) -> None:
        p, x = self.p, self.x
        hub = x["speed"] - across * x["yaw_rate"] + (p["cg_height"] - p["wheel_radius"]) * x["pitch_rate"]
        sideways = x["lateral_speed"] + ahead * x["yaw_rate"] + p["cg_height"] * x["roll_rate"]
        sliding = x[f"wheel_speed_{at}"] * p["wheel_radius"] - hub
        peak = p["tire_D"] * (1.0 - p["tire_load_sensitivity"] * (load - static))
        tread = 1.0 / (1.0 + hub**4)
        b = p["tire_B"] * (x[f"slip_{at}"] + tread / p["tire_B"] * sliding)
        forward = load * peak * np.sin(p["tire_C"] * np.arctan(b - p["tire_E"] * (b - np.arctan(b))))
        self.forward[at] = forward
        lateral = x[f"lateral_slip_{at}"] - tread / p["tire_cornering_stiffness"] * sideways
        line = p["tire_cornering_stiffness"] * lateral
        left = load * line / np.hypot(1.0, line / peak)
        self.lost += forward * sliding - left * sideways

    def _friction(self, at: str, load: Array, brake: Array) -> None:
        p, x, r = self.p, self.x, self.p["wheel_radius"]
        rim, rub = r * x[f"wheel_speed_{at}"], r * (x[f"wheel_speed_{at}"] + x["pitch_rate"])
        self.lost += p["rolling_resistance"] * load * rim * sense(x[f"rolling_bend_{at}"], rim, 0.1)
        self.lost += brake / 2 / r * rub * sense(x[f"brake_bend_{at}"], rub, 1e-3)

    def _driveline(self, torque: Array) -> None:
        """Motor on the body, carrier, side gears (with the inertia by which the model holds them back), half-shafts."""
        p, x = self.p, self.x
        carrier = x["carrier_speed_front"] + p["motor_reaction"] * x["pitch_rate"]
        self.kinetic += 0.5 * p["driveline_inertia"] * x["carrier_speed_front"] ** 2
        self.put_in = self.put_in + torque * carrier
        apart = np.zeros(self.run.time.size)
        if "side_gear_speed_front" in x:
            stiffness = p["shaft_stiffness_left"] + p["shaft_stiffness_right"]
            inertia = 2 * p["side_gear_inertia"] + stiffness * HELD**2
            rate = (self.run.outputs["shaft_torque_right"] - self.run.outputs["shaft_torque_left"]) / inertia
            apart = x["side_gear_speed_front"] + HELD * rate
            self.kinetic += 0.5 * inertia * x["side_gear_speed_front"] ** 2
            self.lost += inertia * HELD * rate**2
        for at, side, inner in (("fl", "left", carrier + apart), ("fr", "right", carrier - apart)):
            self.stored += 0.5 * p[f"shaft_stiffness_{side}"] * x[f"twist_{at}"] ** 2
            self.lost += p[f"shaft_damping_{side}"] * (inner - x[f"wheel_speed_{at}"] - x["pitch_rate"]) ** 2


def sense(bend: Array, speed: Array, time: float) -> Array:
    size = np.sqrt(speed**2 + 1e-8) - 1e-4
    rate = (speed - size * bend) / (0.002 + 0.005 * size)
    return np.asarray(bend + time * rate / (1.0 + (speed / 0.1) ** 2))
