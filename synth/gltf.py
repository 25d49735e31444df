"""The scene as one binary glTF file (.glb), units metres as the format asks."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np

from synth.meshes import Mesh

METRES_PER_MM = 1e-3
_FLOAT, _UINT = 5126, 5125
_VERTICES, _INDICES = 34962, 34963


def write_glb(path: Path, meshes: list[Mesh]) -> Path:
    """Write `meshes` to `path`; every mesh is a named node with its own material."""
    chunk = bytearray()
    views: list[dict[str, object]] = []
    accessors: list[dict[str, object]] = []

    def add(array: np.ndarray, target: int, kind: str, component: int) -> int:
        while len(chunk) % 4:
            chunk.append(0)
        data = array.tobytes()
        views.append(
            {"buffer": 0, "byteOffset": len(chunk), "byteLength": len(data), "target": target}
        )
        chunk.extend(data)
        flat = array.reshape(len(array), -1) if kind == "VEC3" else array
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": component,
                "count": len(array),
                "type": kind,
                "min": np.atleast_1d(flat.min(axis=0)).tolist(),
                "max": np.atleast_1d(flat.max(axis=0)).tolist(),
            }
        )
        return len(accessors) - 1

    parts, nodes, materials = [], [], []
    for number, mesh in enumerate(meshes):
        position = add((mesh.points * METRES_PER_MM).astype("<f4"), _VERTICES, "VEC3", _FLOAT)
        normal = add(mesh.normals.astype("<f4"), _VERTICES, "VEC3", _FLOAT)
        index = add(mesh.triangles.astype("<u4").ravel(), _INDICES, "SCALAR", _UINT)
        primitive = {
            "attributes": {"POSITION": position, "NORMAL": normal},
            "indices": index,
            "material": number,
        }
        parts.append({"name": mesh.name, "primitives": [primitive]})
        nodes.append({"name": mesh.name, "mesh": number})
        surface = {
            "baseColorFactor": [*mesh.rgb, 1.0],
            "metallicFactor": mesh.metallic,
            "roughnessFactor": 0.6,
        }
        materials.append({"name": mesh.name, "pbrMetallicRoughness": surface})
    story = {
        "asset": {"version": "2.0", "generator": "tsvision synth"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": parts,
        "materials": materials,
        "buffers": [{"byteLength": len(chunk)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = json.dumps(story).encode()
    text += b" " * (-len(text) % 4)
    chunk.extend(b"\0" * (-len(chunk) % 4))
    total = 12 + 8 + len(text) + 8 + len(chunk)
    with path.open("wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, total))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", len(chunk), b"BIN\0") + bytes(chunk))
    return path
