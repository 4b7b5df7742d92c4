"""The simulated car: parameters with their prior, effects, sensors, integration."""
