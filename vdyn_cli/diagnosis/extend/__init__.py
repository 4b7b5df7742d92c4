"""The model extended by the named effects, with intervals that hold every answer left open."""
