"""The exception of the package, and suggestions for misspelt names."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import SequenceMatcher, get_close_matches

ALIKE = 0.6  # ratio of two names from which one may be a misspelling of the other


class UserError(Exception):
    """An error that the user can correct; its text is one sentence, or the messages of `describe`."""


class InvalidArgument(UserError):
    """An option, value or combination of a command line that is wrong for every file."""


def listed(names: Sequence[str]) -> str:
    """Returns up to five names, of more the first four and the number of the others."""
    return ", ".join(names if len(names) <= 5 else [*names[:3], f"{names[3]} and {len(names) - 4} more"])


def named(known: Iterable[str]) -> str:
    """Returns `; available: a, b and 7 more`, for a name without a similar one."""
    known = list(known)
    return f"; available: {listed(known)}" if known else "; none are available"


def unknown(kind: str, name: str, known: Iterable[str]) -> UserError:
    """Returns the error of a name that is not known, with the most similar one or some of them."""
    known = list(known)
    return UserError(f"unknown {kind} '{name}'{did_you_mean(name, known) or named(known)}")


def _same_kind(known: str, name: str) -> bool:
    """Returns whether options are alike without their dashes, and the last parts of variables share a letter: not joint.tau for joint.q."""
    if name.startswith("--"):
        return SequenceMatcher(None, known.lstrip("-"), name.lstrip("-")).ratio() >= ALIKE
    return "." not in name or "." not in known or bool(set(known.rpartition(".")[2]) & set(name.rpartition(".")[2]))


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Returns `; did you mean 'x'?` for the nearest known name, or an empty string."""
    known = list(known)
    near = [k for k in get_close_matches(name, known, n=len(known) or 1, cutoff=ALIKE) if _same_kind(k, name)]
    # of equally similar names the first in the model's order
    near.sort(key=lambda k: (-SequenceMatcher(None, k, name).ratio(), known.index(k)))
    if not near:
        # with a missing or wrong joint index, a name with the same beginning
        near = [k for k in known if name and (k.startswith(name) or name.startswith(k))][:1]
    if not near:
        # another owner, such as the link of a joint, and the only variable with this ending
        ending = name[name.rindex(".") :] if "." in name else ""
        same = [k for k in known if ending and k.endswith(ending)]
        near = same if len(same) == 1 else []
    return f"; did you mean '{near[0]}'?" if near else ""
