"""A body that swings freely: its period from a recording, and inertia or stiffness from that. Shared by two steps."""
