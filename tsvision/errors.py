"""The one error that a user may see: what is wrong, where, and what would mend it."""

from __future__ import annotations


def why_unread(problem: Exception) -> str:
    """Why a file could not be read, without the system's numbers and the path again."""
    if isinstance(problem, FileNotFoundError):
        return "no such file"
    system = problem.strerror if isinstance(problem, OSError) else None
    return system or " ".join(str(problem).split())


class InputError(ValueError):
    """Bad input or bad usage. The message is one line and names the mend; the CLI exits with 2."""
