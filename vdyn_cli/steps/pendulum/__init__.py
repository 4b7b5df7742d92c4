"""A pendulum: its period from a recording, and inertia or stiffness from the period. Shared by two steps."""
