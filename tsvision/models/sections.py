"""The shelf of bundle sections: one file each, one explicit line here."""

from __future__ import annotations

from tsvision.models import packing_fraction, pair_core, ring
from tsvision.models.shelf import BundleSection

SECTIONS: dict[str, BundleSection] = {
    section.name: section for section in (pair_core.SECTION, ring.SECTION, packing_fraction.SECTION)
}
