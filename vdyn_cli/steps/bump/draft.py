"""Lines that ``vdyn init`` adds to the channels of a bump test: keys that no log contains."""

DRAFT = """\
vehicle:
  mass: "?"                 # as tested, such as 1588 +- 2 kg
  wheelbase: "?"            # such as 2.700 m
  cg_to_rear: "?"           # from the step cg, such as 1.45 m
  pitch_inertia: "?"        # from the step cg, such as 2200 kg m^2
  unsprung_mass_front: "?"  # both wheels with their carriers, such as 82 kg
  unsprung_mass_rear: "?"   # both wheels with their carriers, such as 70.7 kg
# manoeuvre: drop            # a rig or car released above its rest position; then remove 'bump', and map heights
bump:
  height: "?"               # largest, such as 50 mm
  width: "?"                # along the road, such as 400 mm
  shape: "?"                # haversine, half_sine or profile, such as haversine
"""
RUN = "distance_front: distance from the log's start to the bump, where it is measured"
