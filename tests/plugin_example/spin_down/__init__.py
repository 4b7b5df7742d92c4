"""A wheel that is spun by hand and left to come to rest: an effect, a step and a log format for vdyn."""
