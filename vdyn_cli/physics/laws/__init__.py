"""Laws of single elements, one per file, in plain arithmetic on named signals."""
