"""The run log: one JSON line an event, appended; the only file of a batch that knows the time."""

from __future__ import annotations

import json
import time
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Any

from tsvision.atomic import telling_what_failed


class RunLog:
    """Appends to `out`/log/run.jsonl. `elapsed_s` comes from a clock that never jumps."""

    def __init__(self, out: Path) -> None:
        self._path = out / "log" / "run.jsonl"
        self._start_s = time.monotonic()

    def __enter__(self) -> RunLog:
        with telling_what_failed(self._path):
            self._path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._path.open("a", encoding="utf-8")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is not None:
            self.write("stopped", problem=kind.__name__)
        self._file.close()

    def write(self, event: str, **values: Any) -> None:
        """Append one event; a full disk does not stop the batch here."""
        line = {
            "time": datetime.now(UTC).isoformat(timespec="seconds"),
            "elapsed_s": round(time.monotonic() - self._start_s, 3),
            "event": event,
            **values,
        }
        try:
            self._file.write(json.dumps(line, ensure_ascii=True) + "\n")
            self._file.flush()
        except OSError:
            return
