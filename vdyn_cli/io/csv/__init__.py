"""CSV logs with any delimiter, encoding and decimal mark."""
