"""Keys of a validation that cannot be read from logs, for ``vdyn init``."""

DRAFT = """\
vehicle:
  gear_ratio: "?"           # turns of the torque sensor's shaft per turn of the wheel, such as 3.267
  # mass, drag_area, ... come from the other steps: --known parameters.json
"""
SETTINGS = """\
settings:
  model: road_load          # a mass on a road; 'vehicle' needs the parameters of all steps
  driven: "?"               # driven axle, front, rear or both, such as front
"""
RUN = "direction: out or back"
