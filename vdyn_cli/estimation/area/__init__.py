"""Frontal area from a silhouette."""
