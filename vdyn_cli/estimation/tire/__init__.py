"""The tyre's slip curve."""
