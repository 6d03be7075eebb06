"""Blocks as HTML: every block is shown, and no text of one becomes a tag."""

from pages import Page
from payloads import MARKUP, Structure

from exfit.output.blocks import Cell, Facts, Heading, Note, Table, Verbatim, columns, row
from exfit.output.html import html


def page_of(text):
    """Return the page of blocks whose every text is the same."""
    heads = columns(text, text, numbers=(text,))
    return html(
        [
            Heading(text, 2),
            Facts(((text, text),)),
            Note(text, label=text, mark="bad"),
            Note(text, "warning"),
            Note(text, "warning"),
            Table(heads, ((Cell(text), Cell(text, "bad")), (Cell(text), Cell(text))), text),
            Verbatim(text),
        ]
    )


def test_every_text_is_shown_and_none_becomes_a_tag():
    plain = Structure(page_of("word"))
    assert page_of("word").lower().count("word") == 16  # that of the table names its region, too
    for text in MARKUP:
        if "`" not in text and ": " not in text:
            assert Structure(page_of(text)).tags == plain.tags
            Page(page_of(text))


def test_what_the_headings_of_a_folded_table_mean_is_folded_with_it():
    table = Table(columns("a"), (row("1"),), "t", summary="one line", legend="a: as in `b`")
    assert html([table]).endswith("</div>\n<p>a: as in <code>b</code></p>\n</details>")


def test_warnings_that_follow_each_other_are_one_list():
    page = Page(html([Note("a", "warning"), Note("b", "warning"), Note("c"), Note("d", "remedy")]))
    assert [tag for tag, _ in page.tags] == ["ul", "li", "li", "p", "ul", "li"]


def test_a_row_that_begins_with_a_doubt_is_shaded_and_lines_below_the_first_are_small():
    cells = (Cell("x\nmeaning", "doubt"), Cell("1"), Cell("why", "doubt"))
    page = Page(html([Table(columns("a", "b", "c"), (cells,), "t")]))
    assert ("tr", {"class": "vague"}) in page.tags
    assert ("td", {"class": "why"}) in page.tags
    assert page.tables["T"] == [["a", "b", "c"], ["x meaning", "1", "why"]]
    whole = Page(html([Table(columns("a", "b"), (row("x", "y", mark="doubt"),), "t")]))
    assert [attrs for tag, attrs in whole.tags if tag in ("tr", "td")] == [
        {},
        {"class": "vague"},
        {},
    ]
