"""Lines that ``vdyn init`` adds to the channels of a center of gravity test: keys that no log contains."""

from __future__ import annotations

from collections.abc import Mapping

DRAFT = """\
vehicle:
  mass: "?"                 # as tested, such as 1588 +- 2 kg
  wheelbase: "?"            # such as 2.700 m
  antenna_height: "?"       # of the antenna or accelerometer above ground, such as 1.52 m
  # optional, and narrows the intervals: wheel_radius, unsprung_mass_front, unsprung_mass_rear (of an axle)
"""
RUN = "direction: out or back"
# A rate of the speed over ground is an acceleration for this step, but an accelerometer comes first.
SECOND_CHOICE = {"acceleration": frozenset(("gps", "derived"))}
_OVER_GROUND = ("gps", "gnss", "antenna", "derived", "vbox")


def settings_of(columns: Mapping[str, tuple[str, str]]) -> str:
    """The line of the settings, with the kind of the acceleration by its name.

    Parameters
    ----------
    columns : column and group of each mapped channel.
    """
    name = columns.get("acceleration", ("", ""))[0].lower()
    if not name:
        return "settings: {}                # accelerometer: gps or body, see 'vdyn explain cg'"
    kind = "gps" if any(word in name for word in _OVER_GROUND) else "body"
    return (
        f"settings: {{accelerometer: {kind}}}  # gps: rate of the antenna's speed; body: its reading includes gravity"
    )
