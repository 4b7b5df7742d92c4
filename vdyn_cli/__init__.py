"""From a test day's logs to a vehicle model that can be trusted."""
