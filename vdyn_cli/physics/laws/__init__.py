"""Laws of single elements, in plain arithmetic on named signals."""
