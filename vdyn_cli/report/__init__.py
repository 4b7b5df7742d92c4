"""Self-contained HTML pages of results; the only package that uses matplotlib and jinja2."""
