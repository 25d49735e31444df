"""Synthetic recordings of a twisted string actuator, with exact truth.

State (`actuator`) -> strand paths (`strands`) -> picture (`camera`, `tubes`, `shading`,
`hardware`, `sensor`, `render`) -> files (`recording`, `truth`). Shares no geometry with the
measuring code: the two meet in files and in tests only.
"""

from pathlib import Path

from tsvision.compiled import keep_current

keep_current(Path(__file__).parent)
