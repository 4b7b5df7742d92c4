"""A body that swings freely, recorded: its period, and what that says of inertia or stiffness. Shared by two steps."""
