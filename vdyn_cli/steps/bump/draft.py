"""Lines that ``vdyn init`` adds to the channels of a bump test: keys that no log contains."""

DRAFT = """\
vehicle:
  mass: "?"                 # as tested, such as 1588 +- 2 kg
  wheelbase: "?"            # such as 2.700 m
  cg_to_rear: "?"           # from the step cg, such as 1.45 m
  pitch_inertia: "?"        # from the step cg, such as 2200 kg m^2
  unsprung_mass_front: "?"  # both wheels with their carriers, such as 82 kg
  unsprung_mass_rear: "?"   # both wheels with their carriers, such as 70.7 kg
bump:
  height: "?"               # largest, such as 50 mm
  width: "?"                # along the road, such as 400 mm
  shape: "?"                # haversine, half_sine or profile, such as haversine
"""
RUN = "distance_front: distance from the log's start to the bump, where it is measured"

# The draft where the logs have the channels of another manoeuvre, and none that only this one needs.
MANOEUVRES = {
    "drop": {
        "DRAFT": """\
manoeuvre: drop             # a rig or car released above its rest position
drop: {rig: "?"}            # quarter_car or half_car; with 'axle: rear' or 'wheels: 1' if it is one of these
vehicle:
  sprung_mass: "?"          # carried by the axle on the rig, such as 520 +- 2 kg
  unsprung_mass_front: "?"  # both wheels with their carriers, such as 82 kg
  # a half car needs, instead of 'sprung_mass', mass, wheelbase, cg_to_rear, pitch_inertia and both unsprung masses
"""
    }
}
