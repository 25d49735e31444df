"""DATA as it comes: one CSV, or folders that `tsvision measure` wrote."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tsvision.diagnosis.bundle_table import is_bundle_table, read_diameters
from tsvision.diagnosis.bundles import diagnose_bundles
from tsvision.diagnosis.diagnose import diagnose
from tsvision.diagnosis.folder import table_from_folders
from tsvision.diagnosis.observations import Table
from tsvision.diagnosis.table import read_rows, read_table
from tsvision.diagnosis.verdict import Verdict
from tsvision.errors import InputError
from tsvision.records import Rig


def diagnose_sources(paths: Sequence[Path], rig: Rig, model: str | None = None) -> Verdict:
    """Diagnose one CSV, or one or more measured folders (each a run).

    `model` is questioned: a displacement model (constant_radius unless told otherwise), or for a
    table of bundle diameters against N a section model (pair_core).
    """
    if len(paths) == 1 and paths[0].is_file():
        header, rows = read_rows(paths[0])
        if is_bundle_table(header, rows):
            d, zone = rig.strings.diameter_mm, rig.actuator.twisting_zone_mm
            data = read_diameters(header, rows, d, zone, str(paths[0]))
            return diagnose_bundles(data, model or "pair_core")
    return diagnose(load(paths, rig), model or "constant_radius")


def load(paths: Sequence[Path], rig: Rig) -> Table:
    """The table of DATA; InputError when a path is neither a CSV nor a measured folder."""
    missing = [path for path in paths if not path.exists()]
    if missing:
        raise InputError(f"'{missing[0]}' does not exist; give a CSV or a measured folder")
    if all(path.is_dir() for path in paths):
        return table_from_folders(paths, rig)
    if len(paths) != 1:
        raise InputError("give one CSV, or one or more folders that `tsvision measure` wrote")
    return read_table(paths[0], rig)
