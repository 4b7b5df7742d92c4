"""Lines that ``vdyn init`` adds to the channels of a center of gravity test: keys that no log contains."""

DRAFT = """\
vehicle:
  mass: "?"                 # as tested, such as 1588 +- 2 kg
  wheelbase: "?"            # such as 2.700 m
  antenna_height: "?"       # of the antenna or accelerometer above ground, such as 1.52 m
  # optional, and narrows the intervals: wheel_radius, unsprung_mass_front, unsprung_mass_rear (of an axle)
"""
SETTINGS = """\
settings: {}                # accelerometer: gps or body, see 'vdyn explain cg'
"""
RUN = "direction: out or back"
