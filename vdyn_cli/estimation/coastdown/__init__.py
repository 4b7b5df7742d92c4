"""The road load from coast-downs and powered drives."""
