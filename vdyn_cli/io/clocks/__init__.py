"""Clocks and rates: sample times, alignment of loggers, channels of different rates."""
