"""Which part of the model is at fault, and its law as learned from the data."""
