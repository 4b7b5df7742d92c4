"""How each step fits its model to its logs: one folder a step, and what several of them share."""
