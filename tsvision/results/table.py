"""Questions to many measured recordings at once, in SQL."""

from __future__ import annotations

from pathlib import Path

import duckdb
import pyarrow as pa

from tsvision.errors import InputError
from tsvision.results.files import SUMMARY
from tsvision.results.overview import recordings_table

TABLES = ("frames", "profiles", "knots")


def query_results(folder: Path, sql: str) -> pa.Table:
    """Run a DuckDB query over the recordings below `folder`.

    Views: `recordings` (one row each, see overview.py), and `frames`, `profiles`, `knots` with a
    column `recording`. Raises InputError, with DuckDB's own words when the SQL is wrong.
    """
    places = measured_below(folder)
    if not places:
        raise InputError(f"{folder}: holds no measured recordings; name the --out of a batch")
    overview = recordings_table(places)
    connection = duckdb.connect(config={"autoinstall_known_extensions": False})
    try:
        connection.register("recordings", overview)
        for table in TABLES:
            files = {name: place / f"{table}.parquet" for name, place in places.items()}
            _make_view(connection, table, {n: f for n, f in files.items() if f.is_file()})
        answer = connection.sql(sql)
        if answer is None:
            raise InputError("results: the SQL gives no table; write a select")
        return answer.to_arrow_table()
    except duckdb.Error as error:
        raise InputError(f"results: {' '.join(str(error).split())}") from None
    finally:
        connection.close()


def measured_below(folder: Path) -> dict[str, Path]:
    """Folders with a measurement in them, by name: of a batch, of a folder, or the one itself."""
    if not folder.is_dir():
        raise InputError(
            f"{folder}: no such folder; name one that `tsvision measure` or `batch` wrote"
        )
    if (folder / SUMMARY).is_file():
        return {folder.resolve().name: folder}
    shelf = folder / "recordings" if (folder / "recordings").is_dir() else folder
    inside = sorted(p for p in shelf.iterdir() if not p.name.startswith("."))
    return {p.name: p for p in inside if (p / SUMMARY).is_file()}


def _make_view(connection: duckdb.DuckDBPyConnection, table: str, files: dict[str, Path]) -> None:
    names = pa.table({"path": [str(f) for f in files.values()], "recording": list(files)})
    connection.register(f"_{table}_names", names)
    listed = ", ".join(_quoted(str(path)) for path in files.values())
    connection.execute(
        f"create view {table} as select n.recording, t.* exclude (filename) from "
        f"read_parquet([{listed}], filename = true, union_by_name = true) t "
        f"join _{table}_names n on n.path = t.filename"
    )


def _quoted(text: str) -> str:
    """A path as an SQL text; DuckDB reads * ? [ in it as a pattern unless bracketed."""
    plain = "".join(f"[{c}]" if c in "*?[" else c for c in text)
    return "'" + plain.replace("'", "''") + "'"
