"""The page of a protocol as one HTML file that needs no other, to be read or printed."""

from html import escape

from oio.procedure.page import BLANK, Item, Page, Rows

STYLE = """body{font:16px/1.5 sans-serif;max-width:50em;margin:2em auto;padding:0 1em;color:#111}
table{border-collapse:collapse;margin:.5em 0}th,td{border:1px solid #767676;padding:.2em .6em;text-align:left;vertical-align:top}
th{font-weight:normal;background:#f2f2f2}li{margin:.8em 0;break-inside:avoid}.blank{margin:.3em 0}
@media print{body{font-size:11pt;margin:0}}"""


def html(page: Page) -> str:
    """Return the page as a document."""
    title = escape(page.title)
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{title}</title><style>{STYLE}</style>'
    body = [
        f"<h1>{title}</h1><p>Date {BLANK} Run {BLANK}</p>",
        *(f"<h2>{heading}</h2>{_table(rows)}" for heading, rows in (("The run", page.choices), ("Places", page.places))),
        f"<h2>Steps</h2><ol>{''.join(map(_item, page.items))}</ol>",
        f"<h2>What the run records</h2>{_table(page.records)}",
    ]
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body><main>{"".join(body)}</main></body></html>\n'


def _item(item: Item) -> str:
    blank = f'<p class="blank">{escape(item.blank)}</p>' if item.blank else ""
    return f"<li><strong>{escape(item.title)}</strong>: {escape(item.text)}{blank}{_table(item.keys) if item.keys else ''}</li>"


def _table(rows: Rows) -> str:
    cells = [f'<tr><th scope="row">{escape(key)}</th><td>{escape(value)}</td></tr>' for key, value in rows]
    return f"<table>{''.join(cells)}</table>"
