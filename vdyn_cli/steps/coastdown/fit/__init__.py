"""The fit of the road load to the selected coasts."""
