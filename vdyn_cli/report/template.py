"""Templates with escaping, style sheet and digit groups. The only module that uses jinja2."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup


def markup(text: str) -> Markup:
    """Mark a text as HTML that needs no escaping; only for texts that this package or matplotlib has escaped."""
    from markupsafe import Markup

    return Markup(text)


@cache
def _environment() -> Environment:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["grouped"] = grouped
    environment.globals["css"] = markup((Path(__file__).parent / "style.css").read_text(encoding="utf-8"))
    return environment


def load() -> None:
    """Compile every template of this folder."""
    for name in _environment().list_templates(extensions=["html"]):
        _environment().get_template(name)


def grouped(text: str) -> Markup:
    """A number as HTML with thousands separated by style only, so that a copied number has no spaces."""
    from markupsafe import Markup, escape

    match = re.fullmatch(r"([−+]?)(\d{5,})(\D.*)?", text, re.DOTALL)
    if match is None:
        return escape(text)
    sign, digits, rest = match.groups()
    head = len(digits) % 3 or 3
    parts = [digits[:head], *(digits[i : i + 3] for i in range(head, len(digits), 3))]
    spaced = Markup("").join(Markup('<span class="k">{}</span>').format(p) for p in parts[1:])
    return escape(sign) + parts[0] + spaced + escape(rest or "")


def fill(template: str, **context: Any) -> str:
    """A template (file name in this folder) with its context filled in; every text is escaped except by ``markup``.

    Raises
    ------
    jinja2.TemplateNotFound : no such file. jinja2.UndefinedError : the template uses a name that ``context`` lacks.
    """
    page = _environment().get_template(template).render(**context)
    return page.encode("utf-8", "replace").decode("utf-8")  # file names may contain lone surrogates


def slug(name: str) -> str:
    """The name converted to the prefix of an HTML id: lower-case letters, digits and hyphens."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "step"
