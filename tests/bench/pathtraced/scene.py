"""The scene for Mitsuba 3: strings, plate, connector, ground, lights; `trace` gives linear RGB."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .camera import Camera
from .mesh import fibres, tube
from .rope import Rope

RGB = tuple[float, float, float]


LAMP_MM = 90.0  # from the target, in units of `Look.light_from`
SURFACES = ("principled", "matt", "plastic")  # of strings: see `string_bsdf`
LAMP_UP = np.array([0.31, 0.95, 0.1])


@dataclass(frozen=True)
class Look:
    """Albedos and lights, linear. `backlight` > 0 makes the ground shine (a diffuser)."""

    strings: tuple[RGB, ...] = ((0.75, 0.73, 0.68),)
    ground: RGB = (0.05, 0.033, 0.024)
    plate: RGB = (0.10, 0.22, 0.50)
    braid: float = 0.25  # contrast of the braid in the albedo
    bump_mm: float = 0.02
    gloss: float = 0.35
    surface: str = SURFACES[0]  # how much of the light is lost at the limb
    fibres: int = 10
    fibre_mm: float = 0.012
    light: float = 11.0  # radiance of the lamp
    light_from: RGB = (-0.6, 0.8, 0.9)  # in picture axes: right, up, to the camera
    lamp_size_mm: float = 50.0
    ambient: float = 0.25
    backlight: float = 0.0
    ground_gap_mm: float = 14.0
    ground_texture: float = 0.06


def newest_llvm() -> str | None:
    """Mitsuba takes the first LLVM it finds; 14 and 15 abort in code generation."""
    found = {
        tuple(map(int, re.findall(r"\d+", path.name))): str(path)
        for path in Path("/usr/lib").glob("**/libLLVM*.so*")
    }
    return found[max(found)] if found else None


def load_mitsuba(threads: int = 1) -> Any:
    """The renderer on one core, compiled where an LLVM library is found, else interpreted."""
    path = newest_llvm()
    if path:
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", path)
    import drjit
    import mitsuba

    mitsuba.set_variant("llvm_ad_rgb", "scalar_rgb")
    if "llvm" in str(mitsuba.variant()):
        drjit.set_thread_count(threads)
    return mitsuba


def noise_texture(size: int, rng: np.random.Generator, slope: float = 2.0) -> np.ndarray:
    """(size, size) smooth random field of unit standard deviation, periodic."""
    k = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)[None])
    k[0, 0] = 1
    spectrum = np.fft.rfft2(rng.normal(size=(size, size))) * k ** (-slope / 2)
    spectrum[0, 0] = 0
    field = np.fft.irfft2(spectrum, s=(size, size))
    return field / field.std()


def braid_tile(size: int = 96) -> np.ndarray:
    """Height (size, size) of two crossing families of yarns, each over and under in turn."""
    v, u = np.meshgrid(*[np.arange(size) / size] * 2, indexing="ij")
    one, two = 4 * u + v, 4 * u - v
    over = np.cos(2 * np.pi * one / 2) * np.cos(2 * np.pi * two / 2) > 0
    return np.where(over, np.abs(np.sin(np.pi * one)), np.abs(np.sin(np.pi * two)))


def bitmap(mi: Any, data: np.ndarray, **more: Any) -> dict[str, Any]:
    picture = mi.Bitmap(np.ascontiguousarray(data, np.float32))
    return {"type": "bitmap", "bitmap": picture, "raw": True, **more}


def string_bsdf(mi: Any, colour: RGB, look: Look) -> dict[str, Any]:
    height = braid_tile()
    along = mi.ScalarTransform3f().scale([1.0, 1 / 0.5])  # two yarn crossings a mm of string
    shade = 1 - look.braid * (1 - height)
    albedo = np.clip(shade[..., None] * np.array(colour), 0.0, 0.95)
    painted = bitmap(mi, albedo, to_uv=along)
    surfaces: dict[str, dict[str, Any]] = {
        # Sends as much as a matt one, rough ones even more, when seen at grazing angles.
        "principled": {"type": "principled", "base_color": painted, "roughness": 1 - look.gloss,
                       "specular": 0.4},
        "matt": {"type": "diffuse", "reflectance": painted},
        # A dielectric's: what is seen at grazing angles is the mirror image of what lies beyond.
        "plastic": {"type": "roughplastic", "diffuse_reflectance": painted, "alpha": 0.3},
    }  # fmt: skip
    fibre = surfaces[look.surface]
    relief = bitmap(mi, height[..., None], to_uv=along)
    return {"type": "bumpmap", "arbitrary": relief, "scale": look.bump_mm, "bsdf": fibre}


def add_tube(mi: Any, scene: dict[str, Any], name: str, points: np.ndarray, r: float,
             bsdf: Any, sides: int = 48) -> None:  # fmt: skip
    vertex, normal, uv, faces = tube(points, r, sides)
    props = mi.Properties()
    props["bsdf"] = bsdf
    mesh = mi.Mesh(name, len(vertex), len(faces), props, True, True)
    values = mi.traverse(mesh)
    for key, data in (("positions", vertex), ("normals", normal), ("texcoords", uv)):
        values["vertex_" + key] = mi.Float(data.astype(np.float32).ravel())
    values["faces"] = mi.UInt32(faces.astype(np.uint32).ravel())
    values.update()
    scene[name] = mesh


def strings_only(mi: Any, rope: Rope) -> Any:
    """The bare strands: what the silhouettes are checked against."""
    scene: dict[str, Any] = {"type": "scene"}
    grey = mi.load_dict({"type": "diffuse"})
    for i, points in enumerate(rope.strands):
        add_tube(mi, scene, f"strand{i}", points, rope.state.strand_d_mm / 2, grey)
    return mi.load_dict(scene)


def build_scene(mi: Any, rope: Rope, camera: Camera, look: Look, seed: int) -> Any:
    """`seed` fixes the fibres and the ground, which stay the same over a recording."""
    rng = np.random.default_rng(seed)
    scene: dict[str, Any] = {"type": "scene", "integrator": {"type": "path", "max_depth": 5}}
    scene.update(hardware(mi, rope, look), **surroundings(mi, camera, look, rng))
    materials = [mi.load_dict(string_bsdf(mi, c, look)) for c in look.strings]
    for i, points in enumerate(rope.strands):
        bsdf = materials[i % len(materials)]
        add_tube(mi, scene, f"strand{i}", points, rope.state.strand_d_mm / 2, bsdf)
    plain = mi.load_dict({"type": "diffuse", "reflectance": rgb(look.strings[0])})
    for i, points in enumerate(fibres(rope.strands, look.fibres, rng)):
        add_tube(mi, scene, f"fibre{i}", points, look.fibre_mm / 2, plain, 6)
    return mi.load_dict(scene)


def rgb(value: RGB) -> dict[str, Any]:
    return {"type": "rgb", "value": list(value)}


def hardware(mi: Any, rope: Rope, look: Look) -> dict[str, Any]:
    """Plate with two holes, connector with spigot and set screw."""
    t = mi.ScalarTransform4f
    state = rope.state
    length, half = state.zone_mm, state.hole_gap_mm / 2
    paint = {"type": "roughplastic", "diffuse_reflectance": rgb(look.plate), "alpha": 0.25}
    metal = {"type": "roughconductor", "material": "Al", "alpha": 0.22}
    both = {"type": "twosided", "nested": metal}
    dark = {"type": "diffuse", "reflectance": rgb((0.01, 0.01, 0.01))}
    hole_r = max(0.3, 0.65 * state.diameter_mm)
    parts: dict[str, Any] = {
        "plate": {"type": "cube", "bsdf": paint,
                  "to_world": t().translate([-1.6, 0, 0]).scale([1.6, 5.4, 2.2])},
        "screw": {"type": "sphere", "bsdf": dark,
                  "center": [length + 2.6, 1.7, 0.9], "radius": 0.5},
    }  # fmt: skip
    for name, y in (("hole0", half), ("hole1", -half)):
        place = t().translate([0.003, y, 0]).rotate([0, 1, 0], 90).scale(hole_r)
        parts[name] = {"type": "disk", "to_world": place, "bsdf": dark}
    for name, start, end, radius in (("spigot", 0.0, 1.1, 0.65), ("body", 1.0, 12.0, 2.0)):
        ends = {"p0": [length + start, 0, 0], "p1": [length + end, 0, 0], "radius": radius}
        parts[name] = {"type": "cylinder", **ends, "bsdf": both}
        cap = t().translate([length + start, 0, 0]).rotate([0, 1, 0], -90).scale(radius)
        parts[name + "_cap"] = {"type": "disk", "to_world": cap, "bsdf": both}
    return parts


def surroundings(mi: Any, camera: Camera, look: Look, rng: np.random.Generator) -> dict[str, Any]:
    """Ground, lamp and ambient light; the lamp is placed in picture axes."""
    t = mi.ScalarTransform4f
    target, basis = np.array(camera.target_mm), camera.basis
    texture = 1 + look.ground_texture * noise_texture(512, rng)
    tile = np.clip(texture[..., None] * np.array(look.ground), 0.002, 0.95)
    spot = target - [0, 0, look.ground_gap_mm]
    ground: dict[str, Any] = {"type": "rectangle", "to_world": t().translate(spot).scale(70)}
    if look.backlight > 0:
        lit = tile / np.mean(look.ground) * look.backlight
        ground["emitter"] = {"type": "area", "radiance": bitmap(mi, lit)}
    else:
        ground["bsdf"] = {"type": "diffuse", "reflectance": bitmap(mi, tile)}
    place, size = lamp_stand(camera, look)
    stand = t().look_at(origin=list(place), target=list(target), up=list(LAMP_UP))
    view = t().look_at(origin=list(camera.eye), target=list(target), up=list(basis[1]))
    fov = float(np.degrees(2 * np.arctan(camera.width / 2 / camera.focal_px)))
    return {
        "ground": ground,
        "lamp": {"type": "rectangle", "to_world": stand.scale(size / 2),
                 "emitter": {"type": "area", "radiance": rgb((look.light,) * 3)}},
        "ambient": {"type": "constant", "radiance": rgb((look.ambient,) * 3)},
        "sensor": {"type": "perspective", "fov": fov, "fov_axis": "x", "to_world": view,
                   "near_clip": 1.0, "far_clip": 1000.0,
                   "film": {"type": "hdrfilm", "width": camera.width, "height": camera.height,
                            "pixel_format": "rgb", "rfilter": {"type": "box"}},
                   "sampler": {"type": "multijitter"}},
    }  # fmt: skip


def lamp_stand(camera: Camera, look: Look) -> tuple[np.ndarray, float]:
    """Where (3,) the lamp stands and its side, mm: as far as LAMP_MM where it hides nothing from
    the camera; else farther and larger, so that as much light falls from the same side."""
    target = np.array(camera.target_mm)
    place = LAMP_MM * (np.array(look.light_from) @ camera.basis)
    for factor in np.arange(1.0, 10.0, 0.1):
        size = factor * look.lamp_size_mm
        if not _in_view(camera, target + factor * place, size):
            return target + factor * place, float(size)
    raise ValueError(f"a lamp from {look.light_from} hides the strings wherever it stands")


def _in_view(camera: Camera, place: np.ndarray, size: float) -> bool:
    """Whether a square that faces the target is hit by what the camera looks along."""
    facing = np.array(camera.target_mm) - place
    facing /= np.linalg.norm(facing)
    left = np.cross(LAMP_UP, facing)
    left /= np.linalg.norm(left)
    wide, high = 0.5 * camera.width / camera.focal_px, 0.5 * camera.height / camera.focal_px
    x, y = np.meshgrid(np.linspace(-wide, wide, 31), np.linspace(-high, high, 31))
    rays = np.stack([x, y, -np.ones_like(x)], axis=-1) @ camera.basis
    reach = (place - camera.eye) @ facing / (rays @ facing)
    off = camera.eye + reach[..., None] * rays - place
    across = np.maximum(abs(off @ left), abs(off @ np.cross(facing, left)))
    return bool(((reach > 0) & (across < 0.5 * size)).any())


def trace(mi: Any, scene: Any, spp: int, seed: int) -> np.ndarray:
    """(H, W, 3) linear RGB."""
    return np.array(mi.render(scene, spp=spp, seed=seed))[..., :3]
