"""Rows that are read from object stores and written to them: a real S3 server, one that fails, and fsspec's memory."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from fsspec import AbstractFileSystem
from fsspec.core import url_to_fs
from fsspec.implementations.memory import MemoryFileSystem
from s3fs import S3FileSystem

from avatar_export.batch import stores
from avatar_export.batch.failures import StoreError
from avatar_export.batch.job import Job
from avatar_export.batch.row import do
from avatar_export.conversion import convert
from avatar_export.convert_options import ConvertOptions
from avatar_runtime.bundle import load
from avatar_runtime.io.errors import AvatarError
from tests.exporter.batch.conftest import QUICK
from tests.exporter.batch.s3_server import BUCKET, SECRET, Answer, Proxy, proxied, store_server
from tests.exporter.readers import splatting_files

Files = dict[str, bytes]


@pytest.fixture(scope="module")
def proxy() -> Iterator[Proxy]:
    with store_server() as port, pytest.MonkeyPatch.context() as patch, proxied(port, patch) as proxy:
        yield proxy


@pytest.fixture
def s3(proxy: Proxy) -> Iterator[Proxy]:
    """An empty bucket behind a proxy that passes everything on."""
    proxy.seen.clear()
    yield proxy
    proxy.answer = lambda method, path: None
    store = S3FileSystem(use_listings_cache=False)
    left = store.find(BUCKET)
    if left:
        store.rm(left)


@pytest.fixture
def memory() -> Iterator[MemoryFileSystem]:
    store = MemoryFileSystem()
    yield store
    store.store.clear()
    store.pseudo_dirs[:] = [""]


@pytest.fixture(scope="module")
def converted(face: Path, tmp_path_factory: pytest.TempPathFactory) -> Files:
    out = tmp_path_factory.mktemp("converted") / "one"
    convert(face, out, ConvertOptions(**QUICK))
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob("*") if path.is_file()}


def below(location: str) -> Files:
    store, path = url_to_fs(location, use_listings_cache=False)
    return {name.strip("/")[len(path.strip("/")) + 1 :]: store.cat_file(name) for name in store.find(path)}


def row_in(base: str, face: Path) -> Job:
    store: AbstractFileSystem
    store, path = url_to_fs(f"{base}/in/face.npz")
    store.pipe_file(path, face.read_bytes())
    return Job("one", f"{base}/in/face.npz", f"{base}/out/one", QUICK)


def test_a_row_from_and_to_s3(s3: Proxy, face: Path, converted: Files, tmp_path: Path) -> None:
    job = row_in(f"s3://{BUCKET}", face)
    result = do(job, "first")
    assert (result.state, result.output) == ("done", f"s3://{BUCKET}/out/one")
    files = below(job.output)
    record = json.loads(files.pop("result.json"))
    key = record["folder"]
    assert key.startswith("first-")
    assert files == {f"{key}/one/{name}": data for name, data in converted.items()}
    written = [path.rpartition("/")[2] for method, path in s3.seen if method == "PUT"]
    assert written[-2:] == ["avatar.json", "result.json"]
    assert do(job, "second").state == "kept"
    assert below(job.output).keys() == {*files, "result.json"}
    S3FileSystem().get(f"{BUCKET}/out/one/{key}/one", str(tmp_path / "copied"), recursive=True)
    assert load(tmp_path / "copied").gaussians.count > 0
    assert SECRET not in json.dumps([record, result.as_json()])


@pytest.mark.parametrize("broken", ["face.npz", "gaussians.ply", "result.json"])
def test_a_store_that_answers_500(broken: str, s3: Proxy, face: Path) -> None:
    job = row_in(f"s3://{BUCKET}", face)
    verb = "GET" if broken == "face.npz" else "PUT"
    s3.answer = failing(verb, broken)
    result = do(job, "a")
    assert (result.state, result.kind, result.retryable) == ("failed", "store", True)
    assert "\n" not in result.message and SECRET not in json.dumps(result.as_json())
    assert f"s3://{BUCKET}/" in result.message and "avatar-batch" not in result.message
    left = below(job.output)
    assert left == {} or (broken == "result.json" and "result.json" not in left)
    s3.answer = lambda method, path: None
    assert do(job, "a").state == "done"


def failing(verb: str, name: str, code: int = 500) -> Answer:
    return lambda method, path: code if (method, path.endswith(name)) == (verb, True) else None


def test_the_older_result_stays_when_the_store_fails(s3: Proxy, face: Path) -> None:
    job = row_in(f"s3://{BUCKET}", face)
    assert do(job, "a").state == "done"
    before = below(job.output)
    s3.answer = failing("PUT", "result.json")
    assert do(replace(job, options={**QUICK, "exact": True}), "b").state == "failed"
    after = below(job.output)
    assert {name: after[name] for name in before} == before
    s3.answer = failing("PUT", "", 403)
    refused = do(replace(job, name="two", output=f"{job.output}2"), "a")
    assert (refused.state, refused.kind, refused.retryable) == ("failed", "access", False)
    s3.answer = lambda method, path: None
    elsewhere = do(Job("one", str(face), "s3://elsewhere/one", QUICK), "a")
    assert elsewhere.kind == "output" and "no such bucket" in elsewhere.message


def test_what_is_no_result_is_never_replaced(memory: MemoryFileSystem, face: Path) -> None:
    job = row_in("memory://bucket", face)
    memory.pipe("/bucket/out/one/avatar.json", b"{}")
    result = do(job, "a")
    assert (result.state, result.kind) == ("failed", "output")
    assert below(job.output) == {"avatar.json": b"{}"}
    memory.pipe("/bucket/in/face.npz", face.read_bytes()[:2000])
    message = do(replace(job, output="memory://bucket/out/two"), "a").message
    assert "memory://bucket/in/face.npz" in message and "/tmp" not in message, "the URL and not its copy"
    memory.pipe("/bucket/run/point_cloud.ply", b"ply")
    result = do(replace(job, source="memory://bucket/run/point_cloud.ply"), "a")
    assert "is one file of several" in result.message


def test_files_that_options_name_are_fetched(memory: MemoryFileSystem, tmp_path: Path) -> None:
    splatting_files.write_gaussian_run(tmp_path / "run", splatting_files.arrays(degree=3))
    mesh = tmp_path / "mesh.obj"
    mesh.write_text(splatting_files.obj_text(splatting_files.VERTICES * 2))
    for file in (mesh, *(path for path in (tmp_path / "run").rglob("*") if path.is_file())):
        memory.pipe(f"/bucket/{file.relative_to(tmp_path).as_posix()}", file.read_bytes())
    made = []
    for base in (str(tmp_path), "memory://bucket"):
        job = Job("a", f"{base}/run", f"{base}/a", {**QUICK, "mesh": f"{base}/mesh.obj"})
        assert do(job, "a").state == "done"
        made.append({path.rpartition("/")[2]: data for path, data in below(job.output).items()})
        del made[-1]["result.json"]
    assert made[0] == made[1]


@pytest.mark.parametrize("name", ["../face.npz", "a/../../face.npz", "/face.npz"])
def test_a_name_that_leads_out_is_refused(name: str, memory: MemoryFileSystem, tmp_path: Path) -> None:
    memory.pipe("/bucket/run/x", b"x")
    with pytest.raises(AvatarError, match="leads out of its folder"):
        stores.fetch("memory://bucket/run", {name: (1, "")}, tmp_path / "work")


def test_a_file_that_changes_while_it_is_read(memory: MemoryFileSystem, tmp_path: Path) -> None:
    memory.pipe("/bucket/run/x", b"xyz")
    with pytest.raises(StoreError, match="changed while it was read"):
        stores.fetch("memory://bucket/run", {"x": (2, "")}, tmp_path)


def test_too_little_room_for_a_copy(memory: MemoryFileSystem, tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="which has") as caught:
        stores.fetch("memory://bucket/run", {"x": (1 << 60, "")}, tmp_path)
    assert caught.value.kind == "disk full"


def test_a_store_whose_library_is_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def without_gcsfs(location: str, **options: object) -> object:
        if location.startswith("gs:"):
            raise ImportError("Please install gcsfs to access Google Storage")
        return url_to_fs(location, **options)

    monkeypatch.setattr(stores, "url_to_fs", without_gcsfs)
    result = do(Job("a", "gs://bucket/a.zip", str(tmp_path / "a")), "a")
    assert result.kind == "library" and "gcsfs" in result.message
