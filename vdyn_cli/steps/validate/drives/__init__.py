"""From logs to the segments that are simulated: torques, regimes, and what is left out."""
