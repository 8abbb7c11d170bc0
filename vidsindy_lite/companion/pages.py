"""Pages and parts of pages, from the templates that lie beside this module."""

from pathlib import Path

import jinja2
from jinja2.runtime import Macro

_PAGES = jinja2.Environment(
    loader=jinja2.FileSystemLoader(Path(__file__).parent),
    autoescape=jinja2.select_autoescape(["html"]),
    undefined=jinja2.StrictUndefined,
    keep_trailing_newline=True,
)


def page(template: str, **values: object) -> str:
    """A template filled in; in HTML, values are escaped."""
    return _PAGES.get_template(template).render(values)


def macros(template: str, **values: object) -> dict[str, Macro]:
    """The macros of a template by name, which may use these values."""
    module = _PAGES.get_template(template).make_module(values)
    return {name: part for name, part in vars(module).items() if isinstance(part, Macro)}
