"""Texts that would do something if a page or a terminal took them for its own, put everywhere."""

import copy
import json
from html.parser import HTMLParser
from typing import Any

from mutants import CONTROL_TEXT, at_place, places_of

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
HARMLESS = (
    "harmless words `code` of/the same\nplaces"  # a slash, as above: what follows names a file
)
# keys of texts that must be one of a few words, and of one that is drawn: its form is its picture
WORDS = (
    "interval_method", "method", "percent_of", "verdict", "ways", "drawing", "outcome", "quantity",
)  # fmt: skip


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


def with_texts(saved: dict[str, Any], text: str) -> Any:
    """Return a result with a text behind each of its texts and names, as far as they are free."""
    changed = copy.deepcopy(saved)
    for place in places_of(saved):
        key = next(part for part in reversed(place) if isinstance(part, str))
        if isinstance(at_place(saved, place), str) and key not in WORDS:
            at_place(changed, place[:-1])[place[-1]] += text
    names = [*saved["parameters"], *saved["about"]]
    names += [match["name"] for match in (*saved["records"], *saved["validation"])]
    source = json.dumps(changed)
    for name in names:
        source = source.replace(json.dumps(name), json.dumps(name + text))
    return json.loads(source)
