"""What ``vdyn init`` writes beside the channels of slip sweeps: keys that no log tells."""

DRAFT = """\
vehicle:
  wheel_radius: "?"         # effective rolling radius, such as 308 +- 0.5 mm
"""
SETTINGS = ""
RUN = ""
