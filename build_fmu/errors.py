"""The one exception of the package, and the spelling help that its sentences carry."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import SequenceMatcher, get_close_matches


class UserError(Exception):
    """A problem that the user can act on; its text is one sentence (or the reader's own lines)."""


def named(known: Iterable[str]) -> str:
    """Returns `; there are a, b and 7 more`, for a name that is like none of them."""
    known = list(known)
    shown = known if len(known) <= 5 else known[:4]
    more = f" and {len(known) - len(shown)} more" if len(shown) < len(known) else ""
    return f"; there {'is' if len(known) == 1 else 'are'} {', '.join(shown)}{more}"


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
