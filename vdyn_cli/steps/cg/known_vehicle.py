"""Known parameters of the vehicle in the moment balance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from vdyn_cli.physics.models.load_transfer import EXCESS_GAIN, HEAVE_LEVERS
from vdyn_cli.quantities.constants import GRAVITY, USUAL_WHEELS
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.cg.spec import CgSpec

# Deflection of the tires under the weight of the vehicle, m, where their stiffness is not known: 17 to 25 mm on cars,
# 9 mm on light vehicles with hard tires; and its standard deviation, a share. It matters for the
# axles' motion only, in which the runs show it.
TIRE_DEFLECTION, DEFLECTION_STD = 0.017, 0.4
STIFFNESS, COMPLIANCE = "tire_vertical_stiffness", "tire_vertical_compliance"
UNSPRUNG = ("unsprung_mass_front", "unsprung_mass_rear")
# Passenger cars: 0.5 to 0.8 m^2 (Hucho, Aerodynamics of Road Vehicles). Without drag, the aerodynamic moment about the
# road would be a model error that the diagnosis detects and cannot name.
USUAL_DRAG_AREA, DRAG_AREA_STD = 0.65, 0.15  # m^2
USUAL_COEFFICIENT, COEFFICIENT_STD = 0.35, 0.08  # drag coefficient: cars 0.25 to 0.4, vans to 0.5 (likewise Hucho)
# Tires of cars: 0.006 to 0.015 (UN R117, classes A to E), on rough roads to 0.02.
USUAL_ROLLING, ROLLING_STD, USUAL_RADIUS = 0.010, 0.005, 0.31  # -, -, m
# m, inertia of the wheels over their radius and the mass of the car, which adds to the height at which the car's
# inertia acts: 6 to 13 mm for wheels of 15 to 25 kg, at 0.75 to 0.8 of their radius, on cars of 1000 to 2000 kg.
USUAL_SPIN, SPIN_STD = 0.009, 0.003
# m of heave per rad of pitch, either sign: a body pitches about an axis within a fifth of the wheelbase of its center,
# and anti-dive of the suspension lifts it by as much.
HEAVE_STD = 0.3
# Slope of a tire's friction over slip: 10 on a soft tire, 40 on a stiff one (Gustafsson, Automatica 33(6), 1997: 20 to
# 40 on asphalt; Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012: 10 to 25). Its reciprocal is the slip per friction.
USUAL_COMPLIANCE, COMPLIANCE_STD = 0.05, 0.03
USUAL_RELAXATION, RELAXATION_STD = 0.3, 0.15  # m; 0.1 to 0.6 m (Pacejka 2012)
# Share of the brake torque on the front wheels of cars: 0.55 to 0.8 (Limpert, Brake Design and Safety, 3rd ed. 2011).
USUAL_BRAKE_SHARE, BRAKE_SHARE_STD = 0.67, 0.07
DRAG_HEIGHT_STD = 0.15  # m, of the drag's line of action, which is near the center of gravity: 0.45 to 0.75 m
# Height of the center of gravity as a share of the wheelbase: 0.2 to 0.28, race cars 0.14. Axles that move straight up
# and down hold the hubs in place, and the body turns about an axis at their height. Anti-dive and anti-squat raise it
# (Gillespie, Fundamentals of Vehicle Dynamics, 1992, ch. 7); with much of them the body turns about its center, as
# textbooks have it. The prior's mean is half-way, and its standard deviation the distance to either: three end at the
# road. It is at least the scatter of the heights, which matters where these two nearly coincide.
AXIS, USUAL_HEIGHT_SHARE, HEIGHT_SHARE_STD = "pitch_axis", 0.23, 0.03
LEAST_SLIP = 0.1  # relative standard deviation of a stated one: the axles' loads differ by as much from equal ones
DEFAULTS = {"antenna_offset": 0.0, "air_density": 1.2, "drag_area": USUAL_DRAG_AREA, "drag_height": 0.6}  # m, kg/m^3


@dataclass(frozen=True)
class KnownVehicle:
    """Parameters that are not estimated.

    Parameters
    ----------
    values : by name, SI. std : of the uncertain ones.
    findings : about assumed and neglected values.
    nuisances : mean and standard deviation of the height of the pitch axis, of the tires' slip per friction and
        relaxation length, of their vertical compliance where it is uncertain and matters, and of an assumed drag
        height, whose error the slip would imitate; the runs may determine them better.
    load_excess : share by which the loads exceed the weight, where they contradict it.
    """

    values: Mapping[str, float]
    std: Mapping[str, float]
    findings: tuple[Finding, ...]
    nuisances: Mapping[str, tuple[float, float]]
    load_excess: float = 0.0

    @property
    def typical_pitch_inertia(self) -> float:
        """M L^2 / 5, kg m^2, with mass M and wheelbase L: cars 0.2 to 0.25, vans and motorcycles 0.1 to 0.2."""
        return self.values["mass"] * self.values["wheelbase"] ** 2 / 5

    @property
    def pitch_inertia_std(self) -> float:
        """Standard deviation of ``typical_pitch_inertia``, kg m^2: 0.2 +- 0.08 M L^2 contains nearly all vehicles."""
        return 0.4 * self.typical_pitch_inertia

    @property
    def one_axle_shift(self) -> float:
        """Error of ``cg_to_rear``, m, if one axle's loads alone cause ``load_excess``: half of that share of L."""
        return abs(self.load_excess) * self.values["wheelbase"] / 2


def known_vehicle(spec: CgSpec, known: Parameters) -> KnownVehicle:
    """The known parameters of the balance, with defaults where the results hardly depend on them.

    Raises
    ------
    InputError : mass, wheelbase or antenna_height is missing.
    """
    known.require("mass", "wheelbase", "antenna_height", where="cg")
    findings = []
    values = {n: known[n].value for n in ("mass", "wheelbase", "antenna_height")}
    values |= {n: known.value(n, default) for n, default in DEFAULTS.items()}
    std = {n: known[n].std for n in values if n in known and known[n].std > 0}
    if "drag_area" not in known:
        values["drag_area"], std["drag_area"] = drag, drag_std = _usual_drag_area(known)
        remedy = "give drag_area, or pass the result of 'vdyn coastdown' with --known"
        what = f"drag_area is not given: {drag:.2f} +- {drag_std:.2f} m^2 assumed, which changes the height by 1 %"
        findings.append(Finding("cg", what, "", remedy))
    lead, lead_std = _contact_lead(known)
    values["contact_lead"] = lead
    std |= {"contact_lead": lead_std} if lead_std > 0 else {}
    if "rolling_resistance" not in known:
        remedy = "give rolling_resistance, or pass the result of 'vdyn coastdown' with --known"
        what = (
            f"rolling_resistance is not given: {USUAL_ROLLING:.3f} +- {ROLLING_STD} assumed, which moves cg_to_rear by "
            f"{1e3 * lead:.0f} mm"
        )
        findings.append(Finding("cg", what, "", remedy, minor=True))
    values[EXCESS_GAIN] = 0.0
    values["brake_share_front"] = known.value("brake_share_front", USUAL_BRAKE_SHARE)
    std["brake_share_front"] = known["brake_share_front"].std if "brake_share_front" in known else BRAKE_SHARE_STD
    unsprung, unsprung_std = _unsprung(known, values["mass"])
    values |= unsprung
    std |= unsprung_std
    if len(given := [n for n in UNSPRUNG if n in known]) == 1:
        (other,) = set(UNSPRUNG) - set(given)
        what = f"{given[0]} is not used, since {other} is not given: the axles are assumed not to move on the tires"
        findings.append(Finding("cg", what, "", f"give {other}", minor=True))
    values["reads_gravity"] = 1.0 if spec.settings.accelerometer == "body" else 0.0
    if "wheel_inertia" in known and "wheel_radius" in known:
        inertia, radius = known["wheel_inertia"], known["wheel_radius"].value
        wheels = known.value("wheels", USUAL_WHEELS)
        values["spin"] = wheels * inertia.value / radius
        std |= {"spin": wheels * inertia.std / radius} if inertia.std > 0 else {}
    else:
        values["spin"], std["spin"] = USUAL_SPIN * values["mass"], SPIN_STD * values["mass"]
        remedy = "give wheel_inertia and wheel_radius, or pass the result of 'vdyn inertia' with --known"
        what = (
            "wheel_inertia and wheel_radius are not both given: a usual inertia of the wheels is assumed, which lowers "
            f"cg_height by {1e3 * USUAL_SPIN:.0f} +- {1e3 * SPIN_STD:.0f} mm"
        )
        findings.append(Finding("cg", what, "", remedy))
    half = (USUAL_HEIGHT_SHARE * values["wheelbase"] - known.value("wheel_radius", USUAL_RADIUS)) / 2
    nuisances = {AXIS: (half, max(half, HEIGHT_SHARE_STD * values["wheelbase"])), **_tire_prior(known)}
    # Without a stated mass the runs show only the product of the compliance with an added one.
    if COMPLIANCE in std and any(values[n] > 0 for n in UNSPRUNG):
        nuisances[COMPLIANCE] = values[COMPLIANCE], std.pop(COMPLIANCE)
    nuisances |= {} if "drag_height" in known else {"drag_height": (values["drag_height"], DRAG_HEIGHT_STD)}
    values |= {n: mean for n, (mean, _) in nuisances.items()}
    return KnownVehicle(values, std, tuple(findings), nuisances)


def with_free_heave(vehicle: KnownVehicle) -> KnownVehicle:
    """The vehicle for runs without rear loads: the ratio of heave to pitch is uncertain."""
    what = f"the rear loads are not logged: 0 +- {HEAVE_STD} m of heave per rad of pitch is assumed"
    remedy = "map the rear loads: the interval of pitch_inertia is then several times narrower"
    return replace(
        vehicle,
        values={**vehicle.values, **dict.fromkeys(("heave_lever", *HEAVE_LEVERS), 0.0)},
        std={**vehicle.std, "heave_lever": HEAVE_STD},
        findings=(*vehicle.findings, Finding("cg", what, "", remedy)),
    )


def _unsprung(known: Parameters, mass: float) -> tuple[dict[str, float], dict[str, float]]:
    """Unsprung masses, kg, zero unless both are given, and the tires' compliance, m/N; second: std of the uncertain.

    The axles' motion is proportional to the compliance, so that a fit of it is linear. Without unsprung masses it
    matters for an effect only that adds some.
    """
    compliance = TIRE_DEFLECTION / (mass * GRAVITY / 2)
    spread = DEFLECTION_STD * compliance
    if STIFFNESS in known:
        compliance = 1 / known[STIFFNESS].value
        spread = known[STIFFNESS].std * compliance**2
    values = {COMPLIANCE: compliance, **dict.fromkeys(UNSPRUNG, 0.0)}
    std = {COMPLIANCE: spread} if spread > 0 else {}
    if not all(n in known for n in UNSPRUNG):
        return values, std
    std |= {n: known[n].std for n in UNSPRUNG if known[n].std > 0}
    return {**values, **{n: known[n].value for n in UNSPRUNG}}, std


def _tire_prior(known: Parameters) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of the tires' slip per friction, and of their relaxation length, m."""
    found = {
        "slip_compliance": (USUAL_COMPLIANCE, COMPLIANCE_STD),
        "tire_relaxation_length": (USUAL_RELAXATION, RELAXATION_STD),
    }
    if "tire_longitudinal_stiffness" in known:
        slope = known["tire_longitudinal_stiffness"]
        found["slip_compliance"] = 1 / slope.value, max(slope.std / slope.value, LEAST_SLIP) / slope.value
    if "tire_relaxation_length" in known:
        length = known["tire_relaxation_length"]
        found["tire_relaxation_length"] = length.value, max(length.std, LEAST_SLIP * length.value)
    return found


def _usual_drag_area(known: Parameters) -> tuple[float, float]:
    """A usual drag area and its standard deviation, m^2: of a usual coefficient where the frontal area is known."""
    if "frontal_area" not in known:
        return USUAL_DRAG_AREA, DRAG_AREA_STD
    area = known["frontal_area"].value
    return USUAL_COEFFICIENT * area, COEFFICIENT_STD * area


def _contact_lead(known: Parameters) -> tuple[float, float]:
    """Distance of a rolling tire's contact force ahead of its hub, and its standard deviation, m.

    e = frr r: the load's moment about the hub is that of the rolling resistance.
    """
    radius = known.value("wheel_radius", USUAL_RADIUS)
    rolling = known.value("rolling_resistance", USUAL_ROLLING)
    std = known["rolling_resistance"].std if "rolling_resistance" in known else ROLLING_STD
    return rolling * radius, std * radius
