"""Self-contained HTML pages of results; the only package that uses jinja2."""
