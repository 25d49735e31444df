"""The one error that a user may see: what is wrong, where, and what would mend it."""

from __future__ import annotations


class InputError(ValueError):
    """Bad input or bad usage. The message is one line and names the mend; the CLI exits with 2."""
