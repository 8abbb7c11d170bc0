"""Pages and parts of pages, from the templates that lie beside this module."""

from pathlib import Path

import jinja2

_PAGES = jinja2.Environment(
    loader=jinja2.FileSystemLoader(Path(__file__).parent),
    autoescape=jinja2.select_autoescape(["html"]),
    undefined=jinja2.StrictUndefined,
    keep_trailing_newline=True,
)


def page(template: str, **values: object) -> str:
    """A template filled in; in HTML, values are escaped."""
    return _PAGES.get_template(template).render(values)
