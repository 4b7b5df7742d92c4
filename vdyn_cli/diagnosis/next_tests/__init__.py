"""Which tests to drive next, and what they would show."""
