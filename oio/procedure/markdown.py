"""The page of a protocol as Markdown."""

from collections.abc import Iterator

from oio.procedure.page import BLANK, Page, Rows


def markdown(page: Page) -> str:
    """Return the page as text."""
    return "\n".join(_lines(page)) + "\n"


def _lines(page: Page) -> Iterator[str]:
    yield from (f"# {_plain(page.title)}", "", f"Date {BLANK}  Run {BLANK}", "")
    for title, rows in (("The run", page.choices), ("Places", page.places)):
        yield from (f"## {title}", "", *_table(rows), "")
    yield from ("## Steps", "")
    for number, item in enumerate(page.items, 1):
        yield f"{number}. **{_plain(item.title)}**: {_plain(item.text)}"
        if item.blank:
            yield from ("", f"    {_plain(item.blank)}")
        if item.keys:
            yield from ("", *(f"    {line}" for line in _table(item.keys)))
        yield ""
    yield from ("## What the run records", "", *_table(page.records))


def _table(rows: Rows) -> list[str]:
    return ["| | |", "|---|---|", *(f"| {_plain(key)} | {_plain(value)} |" for key, value in rows)]


def _plain(text: str) -> str:
    """Text that Markdown leaves as it is in a line or a cell."""
    return text.replace("|", "\\|").replace("<", "&lt;")
