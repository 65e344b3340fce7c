"""The face tracker's files: the ones that were tried, and where a page finds them."""

from __future__ import annotations

import gzip
import hashlib
from pathlib import Path
from posixpath import join, normpath

import pytest

from avatar_export.serving import publish, talk
from avatar_export.serving.page import content_type
from avatar_runtime.io.errors import AvatarError
from tests.commands import Run
from tests.exporter.serving.packs import of, running
from tests.exporter.serving.test_publish import Seen, inline


def test_the_files_are_the_ones_that_were_tried() -> None:
    for name, sha256 in talk.FOREIGN.items():
        data = talk.talk_files()[name]
        plain = gzip.decompress(data) if name.endswith(".gz") else data
        assert hashlib.sha256(plain).hexdigest() == sha256, name
    assert b"https://" not in talk.talk_files()["vision_bundle.js"], "releases from 1.0 on report their use"


def test_a_published_page_finds_them_and_its_names_hold_a_hash() -> None:
    files = publish.site([of("x"), of("y")], talk=True)
    said = inline(Seen(files["x/index.html"].decode()))["talk"]
    found = {name: files[normpath(join("x", address))] for name, address in said.items()}
    assert found == talk.talk_files()
    assert all(hashlib.sha256(data).hexdigest()[:16] in said[name] for name, data in found.items())
    assert inline(Seen(publish.site([of("x")])["index.html"].decode()))["talk"] is None


def test_view_serves_them() -> None:
    with running([of("head")]) as here:
        for name, address in here.session()["talk"].items():
            status, headers, data = here.get(here.start + address)
            assert (status, data, headers["content-type"]) == (
                200,
                talk.talk_files()[name],
                content_type(name),
            )


def test_a_page_from_a_disk_gets_no_camera(run: Run, tmp_path: Path) -> None:
    code, _, err = run("publish", tmp_path / "x.avatar", "-o", tmp_path / "x.html", "--single", "--talk")
    assert code == 2 and "a page from a disk gets no camera" in err


def test_a_missing_file_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(talk, "FOLDER", tmp_path)
    with pytest.raises(AvatarError, match=r"tracker\.js: is missing; install avatar-export again"):
        talk.talk_files()
