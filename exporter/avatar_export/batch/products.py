"""The files of a row's folder: the bundle, and what its steps make of it. The same functions as the commands use."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from PIL import Image

from avatar_export import conversion
from avatar_export.batch.failures import StoreError
from avatar_export.batch.job import Job
from avatar_export.checks import bundle as checks
from avatar_export.checks.conform import conform_bundle
from avatar_export.checks.conform_report import verdict
from avatar_export.checks.pack import validate_pack
from avatar_export.convert_options import ConvertOptions
from avatar_export.images import SHEET_SIZE
from avatar_export.notes.note import Note
from avatar_export.notes.text import text
from avatar_export.packing.choices import Choices
from avatar_export.packing.make import Made, pack_of
from avatar_export.playing import frames as playing
from avatar_export.playing import sequences
from avatar_export.serving import publish
from avatar_export.serving.session import identity, shown
from avatar_runtime.avatar import Avatar
from avatar_runtime.io.text_files import write_bytes, write_text
from avatar_runtime.pose import Pose

PREVIEW = "preview.png"
SHOWN = 144  # pixels of an avatar in a report


@dataclass
class Products:
    """What was made, as far as it is made."""

    job: Job
    folder: Path
    avatar: Avatar
    handedness: str
    sizes: dict[str, int] = field(default_factory=dict)  # product -> bytes
    pack: bytes | None = None
    psnr: float | None = None
    message: str = ""

    @property
    def bundle(self) -> Path:
        """The bundle's folder."""
        return self.folder / self.job.product

    @property
    def preview(self) -> str | None:
        """The first image of the contact sheet, made small, as a data: address; None without a contact sheet."""
        path = self.bundle / PREVIEW
        if not path.exists():
            return None
        with Image.open(path) as sheet:
            face = sheet.crop((0, 0, SHEET_SIZE, SHEET_SIZE)).resize((SHOWN, SHOWN))
        out = io.BytesIO()
        face.save(out, "WEBP", quality=80)
        return f"data:image/webp;base64,{base64.b64encode(out.getvalue()).decode()}"

    def doubt(self, notes: Sequence[Note]) -> None:
        """Puts doubts before the message."""
        doubts = (text(note) for note in notes if note.doubtful)
        self.message = "; ".join(filter(None, (*doubts, self.message)))

    def file(self, suffix: str) -> Path:
        """The product that ends in `suffix`."""
        return self.folder / f"{self.job.product}{suffix}"


def make(job: Job, source: Path, options: ConvertOptions, folder: Path) -> Products:
    """Writes the bundle and the products of the row's steps to `folder`.

    Raises AvatarError as the commands do, and for a product that fails its checks.
    """
    made = conversion.convert(source, folder / job.product, options)
    products = Products(job, folder, made.avatar, options.handedness, {"bundle": made.size})
    products.doubt(made.notes)
    for step in job.steps:
        DO[step](products)
    return products


def _made(products: Products) -> Made:
    made = pack_of(products.avatar, Choices(handedness=products.handedness))
    products.doubt(made.notes)
    products.pack = made.file
    return made


def _pack(products: Products) -> None:
    made = _made(products)
    write_bytes(products.file(".avatar"), made.file, force=False)
    products.psnr = made.measured[0].mean
    products.sizes["pack"] = len(made.file)


def _validate(products: Products) -> None:
    problems = checks.validate(products.bundle)
    if "pack" in products.sizes:
        problems = [*problems, *validate_pack(products.file(".avatar"))]
    errors = [problem for problem in problems if not problem.warning]
    if errors:
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        raise StoreError(f"validate: {errors[0]}{more}", kind="check", file=products.job.source)


def _conform(products: Products) -> None:
    found = conform_bundle(products.bundle)
    if not found.passed:
        raise StoreError(f"conform: {verdict(found.report)}", kind="check", file=products.job.source)


def _render(products: Products) -> None:
    out = products.file(".png")
    shown = sequences.PoseSequence([Pose()], 1.0)
    playing.save(
        out, playing.frames(products.avatar, shown, playing.View()), 1, shown.fps, False, lambda _: None
    )
    products.sizes["render"] = out.stat().st_size


def _publish(products: Products) -> None:
    pack = _made(products).file if products.pack is None else products.pack
    avatar = shown(identity(products.job.product, ()), pack, str(products.file(".avatar")))
    page = products.file(".html")
    write_text(page, publish.single(avatar), force=False)
    products.sizes["page"] = page.stat().st_size


DO = {"pack": _pack, "validate": _validate, "conform": _conform, "render": _render, "publish": _publish}
