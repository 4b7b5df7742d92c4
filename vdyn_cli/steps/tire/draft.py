"""What ``vdyn init`` writes for slip sweeps beside the channels: keys that no log contains."""

DRAFT = """\
vehicle:
  wheel_radius: "?"         # effective rolling radius, such as 308 +- 0.5 mm
"""
SETTINGS = ""
RUN = ""
