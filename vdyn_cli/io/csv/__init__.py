"""CSV logs of any delimiter, encoding and decimal sign."""
