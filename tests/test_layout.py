"""The imports run one way: each layer may know only those named here."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parent.parent
BASE = {
    "tsvision",
    "tsvision.records",
    "tsvision.units",
    "tsvision.flags",
    "tsvision.errors",
    "tsvision.compiled",
    "tsvision.jsonable",
    "tsvision.separators",
}
ALLOWED = {
    "tsvision.images": set(),
    "tsvision.measures": {"tsvision.images"},
    "tsvision.timeline": {
        "tsvision.measures",
        "tsvision.images",
        "tsvision.data",
        "tsvision.atomic",
    },
    "tsvision.live": {"tsvision.timeline", "tsvision.images"},
    "tsvision.models": {"tsvision.data"},
    "tsvision.life": {"tsvision.data"},
    "tsvision.riglog": set(),
    "tsvision.actuator": {"tsvision.models", "tsvision.data", "tsvision.life"},
    "tsvision.validation": {
        "tsvision.models",
        "tsvision.data",
        "tsvision.actuator",
        "tsvision.results",
    },
    "tsvision.mechanisms": {"tsvision.models"},
    "tsvision.diagnosis": {"tsvision.models", "tsvision.mechanisms", "tsvision.data"},
    "synth": {"tsvision.staging"},
}
# Within the measuring code: each knows only those before it. Files beside the folders are stages.
STAGES = (
    ("numeric",),
    ("edges",),
    ("helix",),
    ("light",),
    ("ends",),
    ("count", "handedness", "scale"),
    ("looks",),
    ("zone", "sense"),
    ("frame",),
    ("alone",),
    ("late", "cords"),
    ("recording",),
)


def imported_modules(path: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            names.add(node.module)
    return {n for n in names if n.split(".")[0] in ("tsvision", "synth", "cli")}


def test_imports_run_one_way() -> None:
    wrong = []
    for layer, allowed in ALLOWED.items():
        folder = ROOT / Path(*layer.split("."))
        for path in folder.rglob("*.py"):
            for name in imported_modules(path):
                own = name == layer or name.startswith(layer + ".")
                known = any(name == a or name.startswith(a + ".") for a in allowed)
                if not (own or known or name in BASE):
                    wrong.append(f"{path.relative_to(ROOT)} imports {name}")
    assert not wrong, "\n".join(wrong)


def test_measuring_goes_from_stage_to_stage() -> None:
    place = {name: i for i, stage in enumerate(STAGES) for name in stage}
    folder = ROOT / "tsvision" / "measures"
    wrong = []
    for path in sorted(folder.rglob("*.py")):
        own = path.relative_to(folder).with_suffix("").parts[0]
        if own == "__init__":
            continue
        for name in sorted(imported_modules(path)):
            if not name.startswith("tsvision.measures."):
                continue
            known = name.split(".")[2]
            if known != own and not place[known] < place[own]:
                wrong.append(f"{path.relative_to(ROOT)} imports {name}")
    assert not wrong, "\n".join(wrong)


def test_measuring_code_never_imports_the_renderer() -> None:
    wrong = [
        str(path)
        for path in (ROOT / "tsvision").rglob("*.py")
        if any(n.split(".")[0] in ("synth", "cli") for n in imported_modules(path))
    ]
    assert not wrong
