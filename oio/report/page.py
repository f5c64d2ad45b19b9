"""The page: parts with headings, tables and figures, as HTML that needs nothing else; all text is escaped."""

import html
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
SIGNS = {"+-": "\N{PLUS-MINUS SIGN}", "^2": "\N{SUPERSCRIPT TWO}", "*sqrt(s)": " \N{SQUARE ROOT}s", "/sqrt(s)": "/\N{SQUARE ROOT}s"}
LONG = 30  # letters of a word that may be broken anywhere
LONG_NAME = 16  # letters of a name that may be broken at its dots and underscores
NOTHING = "nothing"  # in a cell: a narrow screen leaves it out


@dataclass(frozen=True, slots=True)
class Part:
    """One part of a page: its anchor, heading, and content as HTML."""

    anchor: str
    heading: str
    content: str


def escaped(text: object) -> str:
    """Text as HTML."""
    return html.escape(str(text), quote=True)


def typeset(text: object) -> str:
    """Text for a person as HTML: with the signs that a terminal may lack."""
    html_text = escaped(text)
    for typed, sign in SIGNS.items():
        html_text = html_text.replace(typed, sign)
    return html_text


def paragraph(text: str, kind: str = "") -> str:
    """One paragraph of text."""
    return f"<p{_class(kind)}>{typeset(text)}</p>"


def bullets(texts: Iterable[str], ordered: bool = False) -> str:
    """A list of texts."""
    tag = "ol" if ordered else "ul"
    return f"<{tag}>{''.join(f'<li>{typeset(text)}</li>' for text in texts)}</{tag}>"


def badge(word: str) -> str:
    """PASS, WARN or FAIL as a coloured word."""
    return f'<span class="badge {escaped(word.lower())}">{escaped(word)}</span>'


def table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]], raw: Sequence[int] = (), cards: bool = False) -> str:
    """A table that scrolls by itself on a narrow screen, or with `cards` is a block per row there; the first column heads its rows.

    `raw`: columns that are HTML already.
    """
    head = "".join(f'<th scope="col">{typeset(text)}</th>' for text in heads)
    body = "".join(f"<tr>{''.join(_cell(i, cell, i in raw, heads[i]) for i, cell in enumerate(row))}</tr>" for row in rows)
    inner = f"<table><caption>{escaped(caption)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    kind = "scroll cards" if cards else "scroll"
    return f'<div class="{kind}" role="region" tabindex="0" aria-label="{escaped(caption)}">{inner}</div>'


def figure(name: str, drawing: str, caption: str) -> str:
    """A drawing with its caption, which is its description as well."""
    return f'<figure id="{escaped(name)}"><div class="drawing">{drawing}</div><figcaption>{escaped(caption)}</figcaption></figure>'


def page(title: str, lead: str, parts: Sequence[Part], scripts: str = "") -> str:
    """The whole document: title, lead, a list of the parts, the parts."""
    links = "".join(f'<li><a href="#{escaped(part.anchor)}">{escaped(part.heading)}</a></li>' for part in parts)
    body = "".join(f'<section id="{escaped(part.anchor)}"><h2>{escaped(part.heading)}</h2>{part.content}</section>' for part in parts)
    style = (HERE / "style.css").read_text(encoding="utf-8")
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escaped(title)}</title><link rel='icon' href='data:,'><style>{style}</style></head><body>"
        f'<a class="skip" href="#main">Skip to the content</a><header><h1>{escaped(title)}</h1></header>'
        f'<nav aria-label="Parts of this report"><ol>{links}</ol></nav><main id="main">{lead}{body}</main>{scripts}</body></html>\n'
    )


def _cell(column: int, cell: str, raw: bool, head: str) -> str:
    text = cell if raw else typeset(cell)
    if column == 0:
        breakable = not raw and len(cell) > LONG_NAME
        return f'<th scope="row">{text.replace(".", ".<wbr>").replace("_", "_<wbr>") if breakable else text}</th>'
    kind = "none" if cell == NOTHING else "long" if not raw and any(len(word) > LONG for word in cell.split()) else ""
    return f'<td data-head="{typeset(head)}"{_class(kind)}>{text}</td>'


def _class(kind: str) -> str:
    return f' class="{escaped(kind)}"' if kind else ""
