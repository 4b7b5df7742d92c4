"""Wheel inertia from the road and from a pendulum."""
