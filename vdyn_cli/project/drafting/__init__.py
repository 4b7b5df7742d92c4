"""A first description of unknown logs, for ``vdyn init``."""
