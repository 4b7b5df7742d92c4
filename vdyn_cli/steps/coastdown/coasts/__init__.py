"""Selection of the coasts in the logs: where each begins and ends, and what is left out."""
