"""Logs in: one reader a format, alignment of loggers, quality of channels."""
