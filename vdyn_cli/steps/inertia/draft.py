"""Lines that ``vdyn init`` adds to the channels of a wheel inertia test: keys that no log contains."""

DRAFT = """\
# manoeuvre: stand           # a free wheel that a torque spins up and down; then map hub_torque, or motor_current
vehicle:
  wheel_mass: "?"           # of the rotating parts outside the sensor, such as 20.0 +- 0.1 kg
  wheel_radius: "?"         # effective rolling radius, such as 308 +- 0.5 mm
  rolling_resistance: "?"   # from the step coastdown, such as 0.0095
"""

# Channels of a pendulum's log, which has none of a drive.
PENDULUM_CHANNELS = ("angular_rate", "angle")
PENDULUM = """\
pendulum:
  kind: "?"                 # compound, bifilar or torsional, such as compound
  mass: "?"                 # such as 20.00 +- 0.01 kg
  pivot_distance: "?"       # knife edge to axle, such as 204.8 +- 0.1 mm
"""

# The draft of logs with a torque and a wheel's speed, and no force or motion of a road.
MANOEUVRES = {
    "stand": {
        "DRAFT": """\
manoeuvre: stand            # a free wheel that a torque spins up and down; remove it if the wheel rolled on a road
vehicle: {}
"""
    }
}
