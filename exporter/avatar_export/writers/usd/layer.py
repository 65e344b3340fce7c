"""Between a USD layer in memory and the bytes of a crate file (.usdc), and what a layer leads to outside."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pxr import Sdf, Tf

from avatar_runtime.io.errors import AvatarError

CRATE = ".usdc"
LEADS = ("references", "payload")  # metadata that names other files or prims
NO_PYTHON = ("subLayerOffsets",)  # metadata that has no Python type


def layer_bytes(layer: Any) -> bytes:
    """The layer as a crate file. The same contents give the same bytes in every process, whatever its threads, hash
    seed and earlier work; no date or file name goes in. Another release of the library may pack them otherwise.
    """
    with TemporaryDirectory() as folder:
        file = Path(folder, f"layer{CRATE}")
        try:
            layer.Export(str(file))
            return file.read_bytes()
        except (Tf.ErrorException, OSError):
            raise AvatarError(
                "USD cannot write it; is there room in the temporary folder?", file=folder
            ) from None


def open_layer(data: bytes) -> Any:
    """The Sdf.Layer in `data`, anonymous; nothing is composed, so that no reference is followed.

    Raises AvatarError if the library cannot read it. The library is C++ that takes files at their word: give
    it only bytes of this program's making, or call it in a process of its own as `compare` does.
    """
    with TemporaryDirectory(
        ignore_cleanup_errors=True
    ) as folder:  # Windows keeps a file whose values are mapped
        file = Path(folder, f"layer{CRATE}")
        file.write_bytes(data)
        try:
            layer = Sdf.Layer.OpenAsAnonymous(str(file))
            copy = Sdf.Layer.CreateAnonymous(CRATE)
            copy.TransferContent(layer)
        except (Tf.ErrorException, TypeError):  # TypeError: there is no layer to transfer
            raise AvatarError("is no sound USD crate file") from None
        return copy


def spec_paths(layer: Any) -> list[Any]:
    """Paths of every prim, property and target in the layer, the layer itself first, the rest in order."""
    paths: list[Any] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
    return sorted(paths)


def leads_outside(layer: Any) -> list[str]:
    """Where the layer names another file: sublayers, references, payloads, values that are asset paths."""
    found = [f"sublayer {path}" for path in layer.subLayerPaths]
    for path in spec_paths(layer):
        spec = layer.GetObjectAtPath(path)
        if spec is None:  # a target: a path inside the layer
            continue
        for key in spec.ListInfoKeys():
            if key in LEADS or (key not in NO_PYTHON and _holds_asset(spec.GetInfo(key))):
                found.append(f"{path}: {key}")
        if isinstance(spec, Sdf.AttributeSpec) and spec.typeName in (
            Sdf.ValueTypeNames.Asset,
            Sdf.ValueTypeNames.AssetArray,
        ):
            found.append(f"{path}: is an asset")
    return found


def _holds_asset(value: Any) -> bool:
    if isinstance(value, dict):
        return any(_holds_asset(item) for item in value.values())
    return isinstance(value, Sdf.AssetPath | Sdf.AssetPathArray)
