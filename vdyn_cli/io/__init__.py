"""Reading of logs: one reader per format, alignment of loggers' clocks, quality checks of channels."""
