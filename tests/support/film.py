"""A terminal as an animated SVG: frames that take turns by CSS, with no script and no font.

A row that stays as it was over several frames is written once. Whoever prefers reduced motion, has
no animation at all, or prints the page, sees the last frame.
"""

from collections import defaultdict
from html import escape
from itertools import accumulate, groupby

from rich.cells import cell_len
from rich.console import Console
from rich.segment import Segment
from rich.text import Text

WIDTH, HEIGHT, LETTER = 9.6, 20.0, 16  # of a cell, and of its letters
MARGIN, BAR = 14.0, 34.0  # beside the text; above it, for the three buttons
BACKGROUND, FRAME, PLAIN = "#0d1117", "#30363d", "#d0d7de"
# of the sixteen colours of a terminal, as they are read on a dark ground
COLOURS = {1: "#ff7b72", 2: "#3fb950", 3: "#d29922", 6: "#39c5cf"}
BUTTONS = ("#ff5f57", "#febc2e", "#28c840")


def film(frames, columns, rows):
    """Return the SVG of frames, each a list of lines (Text) and how long it is shown, s."""
    ends = [0.0, *accumulate(seconds for _, seconds in frames)]
    styles, spans = {}, defaultdict(list)
    lines = [rendered(lines, columns, rows, styles) for lines, _ in frames]
    for row in range(rows):
        first = 0
        for content, same in groupby(frame[row] for frame in lines):
            last = first + len([*same])
            if content:
                spans[first, last].append(content)
            first = last
    rules = [f".{name}{{{rule}}}" for rule, name in styles.items()]
    shown, groups = [], []
    for (first, last), contents in sorted(spans.items()):
        begin, end = (100.0 * ends[place] / ends[-1] for place in (first, last))
        name, texts = f"f{first}-{last}", "".join(contents)
        if (first, last) == (0, len(frames)):
            groups.append(texts)
            continue
        groups.append(f'<g class="{name}">{texts}</g>')
        if last < len(frames):
            rules.append(f".{name}{{visibility:hidden}}")
        frame = "0%{visibility:hidden}" if first else ""
        frame += f"{begin:.2f}%{{visibility:visible}}"
        frame += f"{end:.2f}%{{visibility:hidden}}" if last < len(frames) else ""
        shown += [f"@keyframes {name}{{{frame}}}", f"g.{name}{{animation-name:{name}}}"]
    width, height = columns * WIDTH + 2 * MARGIN, rows * HEIGHT + BAR + MARGIN
    buttons = "".join(
        f'<circle cx="{MARGIN + 6 + 20 * k:g}" cy="18" r="6" fill="{fill}"/>'
        for k, fill in enumerate(BUTTONS)
    )
    newline = "\n"
    return f"""<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}">
<style>
text{{font:{LETTER}px "SF Mono",Menlo,Consolas,"DejaVu Sans Mono","Liberation Mono",monospace}}
{newline.join(rules)}
@media screen and (prefers-reduced-motion: no-preference) {{
g[class]{{animation:{ends[-1]:g}s step-end infinite}}
{newline.join(shown)}
}}
</style>
<rect x="0.5" y="0.5" width="{width - 1:g}" height="{height - 1:g}" rx="8" fill="{BACKGROUND}" \
stroke="{FRAME}"/>
{buttons}
{newline.join(groups)}
</svg>
"""


def rendered(lines, columns, rows, styles):
    """Return the text elements of each row, "" where it is empty; note the styles that they use."""
    console, drawn = Console(width=columns), [""] * rows
    for row, line in enumerate(lines[-rows:]):
        segments, across = Segment.simplify(line.render(console)), 0
        for segment in segments:
            text = segment.text.rstrip("\n")
            begin = across + len(text) - len(text.lstrip())
            across += cell_len(text)
            if text.strip():
                drawn[row] += element(text.strip(), segment.style, row, begin, styles)
    return drawn


def element(text, style, row, column, styles):
    """Return the element of a text of one style: as wide as its cells, whatever the font."""
    x, y = MARGIN + column * WIDTH, BAR + row * HEIGHT + LETTER
    number = style.color.number if style and style.color else None
    rule = f"fill:{COLOURS.get(number, PLAIN)}"
    rule += ";font-weight:bold" if style and style.bold else ""
    rule += ";opacity:.65" if style and style.dim and number is None else ""
    name = styles.setdefault(rule, f"s{len(styles)}")
    length = cell_len(text) * WIDTH
    content = escape(text, quote=False).replace(" ", "\N{NO-BREAK SPACE}")
    return f'<text class="{name}" x="{x:g}" y="{y:g}" textLength="{length:g}">{content}</text>'


def lines_of(console):
    """Return the lines that a console has recorded, in their styles."""
    return Text.from_ansi(console.export_text(clear=False, styles=True).rstrip()).split("\n")
