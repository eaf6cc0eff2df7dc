"""Pages of the reports: one environment of templates, with the filters that write numbers and symbols."""

from __future__ import annotations

import json
import re
from functools import cache
from typing import Any, Final

import jinja2
from markupsafe import Markup, escape

from ident.report import digits
from ident.vehicle.parameters import PARAMETER_NAMES

_SYMBOL: Final = re.compile(r"(?P<letter>[A-Za-z])_(?P<index>\w+)")


def render(template: str, **content: Any) -> str:
    """A page as a string; scripts, styles and data are inline, nothing is loaded from anywhere.

    Raises:
        jinja2.UndefinedError: the template names what `content` lacks.
    """
    return _environment().get_template(template).render(content)


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ident.report", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(
        digits=digits.digits,
        percent=digits.percent,
        significant=digits.significant,
        times=digits.times,
        unit=digits.unit_text,
        with_std=digits.with_std,
        plain=digits.plain,
        symbol=_symbol,
        symbols=_symbols,
    )
    return environment


def script_json(value: Any) -> Markup:
    """JSON that cannot end the script element it stands in."""
    return Markup(json.dumps(value, separators=(",", ":")).replace("<", "\\u003c"))


def _symbol(name: str) -> Markup:
    """C_l as C with its index set low; d_vl with the comma of the paper."""
    letter, _, index = name.partition("_")
    if letter == "d":
        index = f"{index[0]},{index[1:]}"
    return Markup("<var>{}<sub>{}</sub></var>").format(letter, index)


def _symbols(text: str) -> Markup:
    """A sentence with the names of (18) in it set as symbols."""

    def typeset(match: re.Match[str]) -> str:
        return str(_symbol(match.group())) if match.group() in PARAMETER_NAMES else match.group()

    return Markup(_SYMBOL.sub(typeset, str(escape(text))))
