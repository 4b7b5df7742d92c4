"""Lines that ``vdyn init`` adds to the channels of slip sweeps: keys that no log contains."""

ONE_OF = (("slip",), ("wheel_speed", "vehicle_speed"))
DRAFT = """\
vehicle:
  wheel_radius: "?"         # effective rolling radius, such as 308 +- 0.5 mm
"""
