"""Centre of gravity and pitch inertia from the axle loads."""
