# SPDX-License-Identifier: Apache-2.0
"""Pieces of a page. Everything is inside the file: no script, no other file, no network."""

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

_STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; color: #1b2430; background: #f5f6f8; margin: 0 auto; max-width: 1160px;
       padding: 20px 24px 60px; }
h1 { font-size: 25px; margin: 8px 0 2px; } h2 { font-size: 18px; margin: 0 0 10px; }
p.lead { margin: 0 0 14px; color: #4d5866; }
section { background: #fff; border: 1px solid #dfe3e8; border-radius: 8px; padding: 14px 18px 16px; margin: 14px 0; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 10px; margin: 14px 0; }
.tile { background: #fff; border: 1px solid #dfe3e8; border-radius: 8px; padding: 9px 13px; }
.tile b { display: block; font-size: 20px; font-variant-numeric: tabular-nums; }
.tile span { color: #5b6673; font-size: 13px; }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(480px, 1fr)); gap: 14px; }
svg, img { max-width: 100%; height: auto; display: block; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 14px; }
.wide { overflow-x: auto; }
th, td { padding: 4px 12px 4px 0; text-align: right; border-bottom: 1px solid #e6e9ed; white-space: nowrap; }
th:first-child, td:first-child, td.text { text-align: left; } th { color: #5b6673; font-weight: 600;
  white-space: normal; overflow-wrap: break-word; vertical-align: bottom; }
.warn { border-left: 4px solid #c2410c; } .good { border-left: 4px solid #15803d; }
.plain { border-left: 4px solid #8a94a0; }
p.note { margin: 6px 0; padding: 4px 12px; background: #f7f8fa; }
pre { overflow: auto; max-height: 420px; background: #f7f8fa; padding: 10px; font-size: 12.5px; }
figcaption, .small { color: #5b6673; font-size: 13px; } figure { margin: 0; }
"""


def document(title: str, lead: str, body: Iterable[str]) -> str:
    """A whole page."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head><body>\n"
        f'<h1>{escape(title)}</h1><p class="lead">{escape(lead)}</p>\n' + "\n".join(body) + "\n</body></html>\n"
    )


def section(title: str, *content: str) -> str:
    """A titled box; nothing when there is no content."""
    filled = [piece for piece in content if piece]
    return f"<section><h2>{escape(title)}</h2>{''.join(filled)}</section>" if filled else ""


def tiles(values: Sequence[tuple[str, str]]) -> str:
    """Large figures with a caption each."""
    cells = (f'<div class="tile"><b>{escape(value)}</b><span>{escape(name)}</span></div>' for name, value in values)
    return f'<div class="tiles">{"".join(cells)}</div>'


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; text cells keep to the left where they hold no figure."""

    def cell(text: str) -> str:
        figure = text.strip()[:1].isdigit() or text.strip()[:1] in ("-", "+", "")
        return f"<td>{escape(text)}</td>" if figure else f'<td class="text">{escape(text)}</td>'

    body = "".join(f"<tr>{''.join(cell(text) for text in row)}</tr>" for row in rows)
    titles = "".join(f"<th>{escape(text)}</th>" for text in head)
    return f'<div class="wide"><table><thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table></div>'


def note(text: str, kind: str = "plain") -> str:
    """A sentence that should be read; kind is plain, good or warn."""
    return f'<p class="note {kind}">{escape(text)}</p>'


def picture(path: Path, caption: str) -> str:
    """A PNG inside the page."""
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    alt = escape(caption, quote=True)
    image = f'<img alt="{alt}" src="data:image/png;base64,{data}">'
    return f"<figure>{image}<figcaption>{escape(caption)}</figcaption></figure>"


def side_by_side(*pieces: str) -> str:
    """Two boxes in a row where the window is wide enough."""
    return f'<div class="pair">{"".join(pieces)}</div>'


def folded(title: str, text: str) -> str:
    """Text that opens on a click."""
    return f"<details><summary>{escape(title)}</summary><pre>{escape(text)}</pre></details>"
