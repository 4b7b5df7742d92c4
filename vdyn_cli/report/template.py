"""The templates' setting: escaping, the style sheet, numbers set in groups. The door to jinja2."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

START, END = "<!--step-->", "<!--/step-->"


def markup(text: str) -> Markup:
    from markupsafe import Markup

    return Markup(text)  # only ever texts that this room, or matplotlib, has escaped


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


def grouped(text: str) -> Markup:
    """A number with its thousands set apart by space alone, so that a copied number stays one."""
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
    """A template with its context set in, every text escaped but what is marked as markup."""
    page = _environment().get_template(template).render(**context)
    return page.encode("utf-8", "replace").decode("utf-8")  # names of files may hold what no page can


def section_of(page: str) -> str:
    """The step's section of its page, empty where the page holds none."""
    start, end = page.find(START), page.rfind(END)
    return page[start + len(START) : end] if 0 <= start < end else ""


def slug(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "step"


def demoted(section: str) -> str:
    """The section one heading level lower; texts of a page never hold a tag, so only headings are met."""
    return re.sub(r"<(/?)h([1-4])\b", lambda m: f"<{m[1]}h{int(m[2]) + 1}", section)
