"""Texts that would do something if a page or a terminal took them for its own, put everywhere."""

import copy
import json
from collections.abc import Iterable
from html.parser import HTMLParser
from typing import Any

from mutants import CONTROL_TEXT, Place, at_place, places_of

MARKUP = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "</script><!--<script><svg onload=alert(1)>",
    "' onmouseover='alert(1)",
    "{{7*7}}{% endif %}",
    "`<b>`</title></style></textarea>",
    "]]><caption>",
)
HOSTILE = " ".join(MARKUP) + CONTROL_TEXT + "two\nlines"
HARMLESS = "harmless words `code` of the same\nplaces"


class Structure(HTMLParser):
    """The tags of a page and the names of their attributes, and the texts of its scripts."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, ...]] = []
        self.scripts: list[str] = []
        self._open = ""
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, *(name for name, _ in attrs)))
        self._open = tag
        if tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag: str) -> None:
        self.tags.append((f"/{tag}",))
        self._open = ""

    def handle_data(self, data: str) -> None:
        if self._open == "script":
            self.scripts[-1] += data

    def handle_comment(self, data: str) -> None:
        self.tags.append(("comment",))


def texts_of(tree: Any) -> list[Place]:
    """Return the places of all texts of a tree."""
    return [place for place in places_of(tree) if isinstance(at_place(tree, place), str)]


def with_text(tree: Any, places: Iterable[Place], text: str) -> Any:
    """Return a tree with a text at places, behind what stands there."""
    changed = copy.deepcopy(tree)
    for place in places:
        at_place(changed, place[:-1])[place[-1]] += text
    return changed


def renamed(tree: Any, names: Iterable[str], text: str) -> Any:
    """Return a tree with a text behind names, wherever they are keys or values."""
    source = json.dumps(tree)
    for name in names:
        source = source.replace(json.dumps(name), json.dumps(name + text))
    return json.loads(source)
