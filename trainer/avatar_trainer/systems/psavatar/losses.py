"""The losses of PSAvatar (Eqs. 12 to 15), of the raw image and of the enhanced one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor
from torch.nn import functional

from avatar_runtime import AvatarError
from avatar_runtime.codec import safetensors
from avatar_runtime.io import open_file
from avatar_trainer.losses import dssim_loss, l1

VGG_SHAPES = {  # of the first four layers of VGG-16 and VGG-19 (convolution, ReLU, twice), named as torchvision does
    "features.0.weight": (64, 3, 3, 3),
    "features.0.bias": (64,),
    "features.2.weight": (64, 64, 3, 3),
    "features.2.bias": (64,),
}
MEAN, DEVIATION = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # of the images that VGG learned from
LARGEST = 1 << 30  # bytes of a file of weights


@dataclass(frozen=True)
class Vgg:
    """The first four layers of a pre-trained VGG network."""

    weights: dict[str, Tensor]

    def __call__(self, image: Tensor) -> Tensor:
        """[64, H, W] features of an image [H, W, 3]; differentiable in it."""
        x = ((image - torch.tensor(MEAN)) / torch.tensor(DEVIATION)).permute(2, 0, 1)[None]
        for layer in ("features.0", "features.2"):
            kernel, bias = self.weights[f"{layer}.weight"], self.weights[f"{layer}.bias"]
            x = functional.relu(functional.conv2d(x, kernel, bias, padding=1))
        return x[0]


def read_vgg(path: Path) -> Vgg:
    """The network of a .safetensors that has at least the tensors of VGG_SHAPES, float32.

    Raises AvatarError for a missing file or another content.
    """
    try:
        with open_file(path) as file:
            data = file.read(LARGEST + 1)
    except OSError as error:
        raise AvatarError(
            f"cannot be read ({error.strerror or error}); it should hold VGG's first layers, vgg=0 does without",
            file=path,
            field="vgg_weights",
        ) from None
    if len(data) > LARGEST:
        raise AvatarError(f"is longer than {LARGEST} bytes", file=path, field="vgg_weights")
    arrays = safetensors.decode(data, str(path))
    weights = {}
    for name, shape in VGG_SHAPES.items():
        array = arrays.get(name)
        if array is None or array.shape != shape or str(array.dtype) != "float32":
            found = "is not there" if array is None else f"is {array.dtype}{list(array.shape)}"
            raise AvatarError(f"{found}, expected float32{list(shape)}", file=path, field=name)
        weights[name] = torch.from_numpy(array.copy())
        if not weights[name].isfinite().all():
            raise AvatarError("is not finite", file=path, field=name)
    return Vgg(weights)


def image_terms(
    drawn: Tensor, target: Tensor, dssim: float, vgg_weight: float, vgg: Vgg | None
) -> dict[str, Tensor]:
    """Weighted terms of one image [H, W, 3]: L1 (Eq. 12), 1 - SSIM in place of VGG, VGG features (Eq. 13).

    The paper's norms are read as means of absolute differences, which do not grow with the image.
    """
    terms = {"l1": l1(drawn, target)}
    if dssim:
        terms["dssim"] = dssim * dssim_loss(drawn, target)
    if vgg is not None:
        with torch.no_grad():
            wanted = vgg(target)
        terms["vgg"] = vgg_weight * (vgg(drawn) - wanted).abs().mean()
    return terms
