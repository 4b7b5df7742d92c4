"""Whether the model is wrong, and what these data could not show."""
