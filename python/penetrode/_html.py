"""What a notebook shows: the text of the command and the figures of its report."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable
from html import escape


def page(text: str, figures: Iterable[str]) -> str:
    """`text` as it stands, and below it the SVG `figures`, each on its own: their styles touch nothing else."""
    # A notebook leaves the font of HTML proportional, and the columns of a text would not stand below each other.
    images = "".join(
        f'<img style="max-width:100%" src="data:image/svg+xml;base64,{b64encode(figure.encode()).decode()}"/>'
        for figure in figures
    )
    return f'<pre style="font-family:monospace">{escape(text.rstrip())}</pre>{images}'
