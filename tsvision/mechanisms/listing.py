"""The shelf as a Markdown table, for the documentation: `python -m tsvision.mechanisms.listing`."""

from __future__ import annotations

from tsvision.mechanisms import MECHANISMS
from tsvision.mechanisms.bundle_causes import BUNDLE_CAUSES


def listing() -> str:
    """Two tables: causes of the actuator's models, causes of the bundle sections."""
    lines = [
        "| mechanism | claim | shapes | shows in | look at |",
        "| --- | --- | --- | --- | --- |",
    ]
    for m in MECHANISMS.values():
        shapes = "; ".join(f"`{s.name}` {_safe(s.equation)}" for s in m.shapes)
        touches = ", ".join(t.rsplit("_", 1)[0].replace("_", " ") for t in m.touches)
        lines.append(f"| `{m.name}` | {m.claim} | {shapes} | {touches} | {m.checks} |")
    lines += [
        "",
        "| cause of a bundle's diameter | claim | formula | what a picture would show |",
        "| --- | --- | --- | --- |",
    ]
    for c in BUNDLE_CAUSES.values():
        lines.append(f"| `{c.name}` | {c.claim} | {_safe(c.equation)} | {c.looks} |")
    return "\n".join(lines)


def _safe(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    print(listing())
