"""Doubts about a fitted road load, and how much wider they make its intervals."""
