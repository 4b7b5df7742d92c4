"""What ``vdyn init`` writes beside the channels of a coast-down: keys that no log tells."""

DRAFT = """\
vehicle:
  mass: "?"                 # as tested, with driver and instruments, such as 1588 +- 2 kg
  rotating_mass: "?"        # wheels and driveline as mass at the tire contact, such as 60 +- 15 kg
  frontal_area: "?"         # gives the drag coefficient from the drag area, such as 2.19 m^2
  # gear_ratio, wheel_radius: needed if drive_torque is mapped
environment:
  temperature: "?"          # of the air, such as 24 degC
  pressure: "?"             # of the air at the track, not reduced to sea level, such as 98.9 kPa
"""
SETTINGS = """\
settings:                   # speed_window: [70 km/h, 25 km/h] limits the fitted part
  windows: auto             # powered: ordinary drives with a measured drive, only where it is above zero
  # road: {profile: FILE}    # surveyed positions and elevations or grades of the road, where position is logged
"""
RUN = "direction: out or back"
FALLING = "speed"  # in a coast-down; other logs without a drive signal are no runs of it
DRIVE = ("drive_torque", "drive_force", "motor_current")
