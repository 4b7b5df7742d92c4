"""Lines that ``vdyn init`` adds to the channels of a shaft test: keys that no log contains."""

ONE_OF = (("twist",), ("motor_speed", "wheel_speed"), ("motor_angle", "wheel_angle"))
DRAFT = """\
shear_modulus: "?"          # of the material, such as 79.3 +- 0.3 GPa
sections:                   # from the inside out, from the drawing
  left:
    - outer_diameter: "?"   # such as 31.00 +- 0.02 mm
      length: "?"           # such as 42.0 mm
"""
SETTINGS = """\
settings:
  gear_ratio: "?"           # motor turns per turn of the shaft (if both speeds are those of its ends: 1), such as 1
"""
RUN = 'side: "?"'
