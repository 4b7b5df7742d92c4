"""One physical part's law per file, in plain arithmetic on named signals."""
