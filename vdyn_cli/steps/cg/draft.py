"""What ``vdyn init`` writes beside the channels of a test of the center of gravity: keys that no log tells."""

DRAFT = """\
vehicle:
  mass: "?"                 # as tested, such as 1588 +- 2 kg
  wheelbase: "?"            # such as 2.700 m
  antenna_height: "?"       # of the antenna or accelerometer above ground, such as 1.52 m
"""
SETTINGS = """\
settings: {}                # accelerometer: gps or body, see 'vdyn explain cg'
"""
RUN = "direction: out or back"
