"""From a Result to one self-contained HTML page; the only room that knows matplotlib and jinja2."""
