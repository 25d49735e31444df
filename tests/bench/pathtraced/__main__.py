"""`python -m tests.bench.pathtraced --list | --render NAME … --out DIR | --verify NAME …`"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from .catalogue import SPECS, vary
from .recording import Spec
from .scene import SURFACES
from .wild import COLOURS

HUES = tuple(name for name, rgb in COLOURS.items() if max(rgb) > 2.0 * min(rgb))


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.bench.pathtraced")
    parser.add_argument("--list", action="store_true", help="names and what they show")
    parser.add_argument("--render", nargs="+", metavar="NAME", default=[], help="or `all`")
    parser.add_argument("--verify", nargs="+", metavar="NAME", default=[], help="check the truth")
    parser.add_argument("--pictures", nargs="+", type=Path, default=[], metavar="DIR",
                        help="check the edges in rendered pictures (backlit ones)")  # fmt: skip
    parser.add_argument("--tables-only", action="store_true", help="with --render: no pictures")
    parser.add_argument("--vary", type=int, default=0, metavar="K", help="draw anew, K-th time")
    parser.add_argument("--wild", nargs="+", type=int, metavar="K", default=[],
                        help="render recordings in which everything is drawn at once")  # fmt: skip
    parser.add_argument("--surface", choices=SURFACES, default=SURFACES[0],
                        help="of the strings (default: %(default)s)")  # fmt: skip
    parser.add_argument("--hue", choices=HUES,
                        help="of all strings, before a ground of equal luma")  # fmt: skip
    parser.add_argument("--jpeg", type=int, metavar="Q", help="coded at this quality")
    parser.add_argument("--gamma", type=float, metavar="G",
                        help="lossless files of light to the power 1 / G, 1: linear")  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("pathtraced"))
    args = parser.parse_args()
    if args.list or not (args.render or args.verify or args.pictures or args.wild):
        for spec in SPECS.values():
            print(f"{spec.name:18} N={spec.count} {len(spec.turns):2} frames  {spec.what}")
    for name in SPECS if args.render == ["all"] else args.render:
        from .recording import write

        spec = of_surface(chosen(name, args.vary, parser), args.surface)
        spec = of_jpeg(of_hue(of_gamma(spec, args.gamma), args.hue), args.jpeg)
        print(write(spec, args.out, not args.tables_only))
    for number in args.wild:
        from .recording import write
        from .wild import wild

        spec = of_gamma(of_surface(wild(number), args.surface), args.gamma)
        spec = of_jpeg(of_hue(spec, args.hue), args.jpeg)
        print(write(spec, args.out, not args.tables_only))
    for name in SPECS if args.verify == ["all"] else args.verify:
        from .verify import verify

        verify(chosen(name, args.vary, parser))
    for folder in args.pictures:
        from .verify import picture_offsets

        picture_offsets(folder)


def chosen(name: str, number: int, parser: argparse.ArgumentParser) -> Spec:
    if name not in SPECS:
        parser.error(f"no recording is called {name!r}; choose from {', '.join(SPECS)}")
    return vary(SPECS[name], number) if number else SPECS[name]


def of_surface(spec: Spec, surface: str) -> Spec:
    """The same recording of strings with another surface."""
    if surface == spec.look.surface:
        return spec
    look = replace(spec.look, surface=surface)
    return replace(spec, name=f"{spec.name}_{surface}", look=look)


def of_hue(spec: Spec, hue: str | None) -> Spec:
    """The same recording of strings of one hue before a ground that is as bright."""
    if hue is None:
        return spec
    look = replace(spec.look, strings=(COLOURS[hue],))
    film = replace(spec.film, mono=False)
    return replace(spec, name=f"{spec.name}_{hue}", look=look, film=film, equal_luma=True)


def of_jpeg(spec: Spec, quality: int | None) -> Spec:
    if quality is None:
        return spec
    film = replace(spec.film, jpeg_quality=quality)
    return replace(spec, name=f"{spec.name}_q{quality}", film=film)


def of_gamma(spec: Spec, gamma: float | None) -> Spec:
    """The same recording as a camera stores it that encodes light another way, and loses none."""
    if gamma is None:
        return spec
    film = replace(spec.film, gamma=gamma, jpeg_quality=None)
    return replace(spec, name=f"{spec.name}_gamma{gamma:g}", film=film)


if __name__ == "__main__":
    main()
