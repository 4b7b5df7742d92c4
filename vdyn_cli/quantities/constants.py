"""Physical and statistical constants that several packages use."""

from __future__ import annotations

ZERO_CELSIUS = 273.15  # K
GRAVITY = 9.80665  # m/s^2, standard gravity (ISO 80000-3)
NORMAL95 = 1.959963984540054  # half-width of the central 95 % of a normal distribution, in standard deviations

USUAL_WHEELS = 4.0  # of a vehicle, where their number is not stated

# Rotating mass of wheels and driveline over the mass, where nothing is given, with its standard deviation: SAE J1263
# and WLTP GTR 15 take 3 %.
ROTATING_SHARE, ROTATING_SHARE_STD = 0.035, 0.01
