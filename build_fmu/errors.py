"""The one exception of the package, and the spelling help that its sentences carry."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import SequenceMatcher, get_close_matches


class UserError(Exception):
    """A problem that the user can act on; its text is one sentence (or the reader's own lines)."""


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Returns `; did you mean 'x'?` for the nearest known name, or an empty string."""
    known = list(known)
    near = get_close_matches(name, known, n=len(known) or 1, cutoff=0.6)
    # of equally near names the first in the model's order
    near.sort(key=lambda k: (-SequenceMatcher(None, k, name).ratio(), known.index(k)))
    if not near:
        # a forgotten or wrong joint index still leads to a name that starts alike
        near = [k for k in known if name and (k.startswith(name) or name.startswith(k))][:1]
    return f"; did you mean '{near[0]}'?" if near else ""
