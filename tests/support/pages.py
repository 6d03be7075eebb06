"""A page of HTML, read as a browser reads it: its tables, its texts, its tags."""

import re
from html.parser import HTMLParser

NUMBER = re.compile(r"^(Table|Figure) (\d+)\. ")
VOID = {"meta", "link", "br", "img", "input", "hr"}


class Page(HTMLParser):
    """The tags of a page with their attributes, the cells of its tables by caption, its words.

    ``numbers`` are those of its tables and of its figures, in their order, ``headings`` the words
    of those that are not its title.
    """

    def __init__(self, html):
        super().__init__()
        self.tags, self.tables, self.words, self.scripts = [], {}, [], []
        self.size = len(html.encode())
        self.numbers = {"Table": [], "Figure": []}
        self.headings = []
        self._open, self._rows, self._caption = [], [], ""
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)
        if tag == "table":
            self._rows, self._caption = [], ""
        elif tag in ("h2", "h3"):
            self.headings.append("")
        elif tag == "tr":
            self._rows.append([])
        elif tag in ("td", "th"):
            self._rows[-1].append("")
        elif tag == "script":
            self.scripts.append("")

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self._open.pop() == tag, f"</{tag}> closes another tag"
        if tag == "table":
            self.tables[NUMBER.sub("", self._caption)] = self._rows

    def handle_data(self, data):
        if self._open and self._open[-1] == "script":
            self.scripts[-1] += data
        elif "style" not in self._open:
            self.words.append(data)
            if number := NUMBER.match(f"{data} "):
                self.numbers[number[1]].append(int(number[2]))
            if {"h2", "h3"} & set(self._open):
                self.headings[-1] += data
            elif "caption" in self._open:
                self._caption += data
            elif {"td", "th"} & set(self._open):
                self._rows[-1][-1] += data

    @property
    def text(self):
        """All words, with single blanks between them."""
        return " ".join(" ".join(self.words).split())

    @property
    def ids(self):
        """The ids in their order."""
        return [attrs["id"] for _, attrs in self.tags if "id" in attrs]

    def count(self, tag):
        """Return how many tags there are of a kind."""
        return sum(name == tag for name, _ in self.tags)
