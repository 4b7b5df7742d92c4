"""The half car from one bump."""
