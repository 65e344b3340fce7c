"""From a USD layer in memory to the bytes of a crate file (.usdc) and back; references of a layer to other files."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pxr import Sdf, Tf

from avatar_runtime.io.errors import AvatarError

CRATE = ".usdc"
LEADS = ("references", "payload")  # metadata that refers to other files or prims
NO_PYTHON = ("subLayerOffsets",)  # metadata that has no Python type


def layer_bytes(layer: Any) -> bytes:
    """The layer as a crate file. The same content gives the same bytes in every process, for any threads, hash seed and
    earlier work; dates and file names are not written. Another release of the library may give other bytes.
    """
    with TemporaryDirectory() as folder:
        file = Path(folder, f"layer{CRATE}")
        try:
            layer.Export(str(file))
            return file.read_bytes()
        except (Tf.ErrorException, OSError):
            raise AvatarError(
                "cannot be written by USD; check the free space of the temporary folder", file=folder
            ) from None


def open_layer(data: bytes) -> Any:
    """The Sdf.Layer in `data`, anonymous; nothing is composed, so that no reference is followed.

    Raises AvatarError if the library cannot read it. The library is C++ that trusts its files: pass only
    bytes that this program made, or call it in a separate process as `compare` does.
    """
    with TemporaryDirectory(
        ignore_cleanup_errors=True
    ) as folder:  # Windows cannot remove a file whose values are mapped
        file = Path(folder, f"layer{CRATE}")
        file.write_bytes(data)
        try:
            layer = Sdf.Layer.OpenAsAnonymous(str(file))
            copy = Sdf.Layer.CreateAnonymous(CRATE)
            copy.TransferContent(layer)
        except (Tf.ErrorException, TypeError):  # TypeError: there is no layer to transfer
            raise AvatarError("is not a sound USD crate file") from None
        return copy


def spec_paths(layer: Any) -> list[Any]:
    """Paths of every prim, property and target in the layer: the layer itself first, the others sorted."""
    paths: list[Any] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
    return sorted(paths)


def leads_outside(layer: Any) -> list[str]:
    """The places where the layer names another file: sublayers, references, payloads, asset paths."""
    found = [f"sublayer {path}" for path in layer.subLayerPaths]
    for path in spec_paths(layer):
        spec = layer.GetObjectAtPath(path)
        if spec is None:  # a target, which is a path inside the layer
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
