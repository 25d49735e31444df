"""`python -m tests.bench.pathtraced --list | --render NAME … --out DIR | --verify NAME …`"""

from __future__ import annotations

import argparse
from pathlib import Path

from .catalogue import SPECS


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.bench.pathtraced")
    parser.add_argument("--list", action="store_true", help="names and what they show")
    parser.add_argument("--render", nargs="+", metavar="NAME", default=[], help="or `all`")
    parser.add_argument("--verify", nargs="+", metavar="NAME", default=[], help="check the truth")
    parser.add_argument("--tables-only", action="store_true", help="with --render: no pictures")
    parser.add_argument("--out", type=Path, default=Path("pathtraced"))
    args = parser.parse_args()
    if args.list or not (args.render or args.verify):
        for spec in SPECS.values():
            print(f"{spec.name:18} N={spec.count} {len(spec.turns):2} frames  {spec.what}")
    for name in SPECS if args.render == ["all"] else args.render:
        from .recording import write

        print(write(chosen(name, parser), args.out, not args.tables_only))
    for name in SPECS if args.verify == ["all"] else args.verify:
        from .verify import verify

        verify(chosen(name, parser))


def chosen(name: str, parser: argparse.ArgumentParser):  # type: ignore[no-untyped-def]
    if name not in SPECS:
        parser.error(f"no recording is called {name!r}; choose from {', '.join(SPECS)}")
    return SPECS[name]


if __name__ == "__main__":
    main()
