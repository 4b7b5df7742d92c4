"""Keys of a validation that cannot be read from logs, for ``vdyn init``."""

DRAFT = """\
vehicle:                    # remove the lines that a parameter file of other steps gives (--known parameters.json)
  mass: "?"                 # as tested, with driver and instruments, such as 1588 +- 2 kg
  rotating_mass: "?"        # wheels and driveline as mass at the tire contact, such as 60 +- 15 kg
  wheel_radius: "?"         # effective rolling radius, such as 308 +- 0.5 mm
  gear_ratio: "?"           # turns of the torque sensor's shaft per turn of the wheel, such as 3.267
  # rolling_resistance, drag_area, ... come from the other steps: --known parameters.json
environment:
  temperature: "?"          # of the air, such as 24 degC
  pressure: "?"             # of the air at the track, not reduced to sea level, such as 98.9 kPa
"""
SETTINGS = """\
settings:
  model: road_load          # a mass on a road; 'vehicle' needs the parameters of all steps
  driven: "?"               # driven axle, front, rear or both, such as front
"""
RUN = "direction: out or back, if all drives are along one road; else none"
RUN_NEEDED = False
