"""A scheduler and a worker with TLS, and clients that have the right certificates, others, or none."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager
from pathlib import Path

import dask
import pytest
from bench.batch.lists import Row, write_list
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from distributed.security import Security

from tests.commands import Refused, Run
from tests.exporter.batch.conftest import cluster_here

PREFIX = "DASK_DISTRIBUTED__COMM__TLS__"  # of the variables that docs/batch.md names
MEMBERS = ("ours", "other")  # each with an authority of its own


def named(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, text)])


def signed(key: ec.EllipticCurvePrivateKey, by: ec.EllipticCurvePrivateKey, authority: bool) -> bytes:
    now = datetime.datetime.now(datetime.UTC)
    made = (
        x509.CertificateBuilder()
        .subject_name(named("authority" if authority else "member"))
        .issuer_name(named("authority"))
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(hours=1))
        .not_valid_after(now + datetime.timedelta(hours=1))
        .add_extension(x509.BasicConstraints(ca=authority, path_length=None), critical=True)
    )
    return made.sign(by, hashes.SHA256()).public_bytes(serialization.Encoding.PEM)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("certificates")
    for name in MEMBERS:
        authority, own = (ec.generate_private_key(ec.SECP256R1()) for _ in range(2))
        (folder / f"{name}-ca.pem").write_bytes(signed(authority, authority, True))
        (folder / f"{name}.pem").write_bytes(signed(own, authority, False))
        (folder / f"{name}.key").write_bytes(
            own.private_bytes(
                serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
            )
        )
    return folder


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    """A scheduler and a worker in this process; they speak TLS over the loopback device."""
    files = {"cert": str(folder / "ours.pem"), "key": str(folder / "ours.key")}
    roles = ("scheduler", "worker", "client")
    own = {f"tls_{role}_{what}": file for role in roles for what, file in files.items()}
    security = Security(tls_ca_file=str(folder / "ours-ca.pem"), require_encryption=True, **own)
    with cluster_here(1, threads_per_worker=1, protocol="tls", security=security) as cluster:
        yield cluster.scheduler_address


def variables(folder: Path, authority: str = "ours", member: str = "ours") -> dict[str, str]:
    return {
        f"{PREFIX}CA_FILE": str(folder / f"{authority}-ca.pem"),
        f"{PREFIX}CLIENT__CERT": str(folder / f"{member}.pem"),
        f"{PREFIX}CLIENT__KEY": str(folder / f"{member}.key"),
    }


def exported(environment: Mapping[str, str]) -> AbstractContextManager[None]:
    read = dask.config.collect_env(environment)
    return dask.config.set(dask.config.merge(dask.config.config, read))


def test_a_batch_over_tls(address: str, folder: Path, made: list[Row], run: Run, tmp_path: Path) -> None:
    write_list(tmp_path / "list.csv", made[5:], 1)
    assert address.startswith("tls://")
    with exported(variables(folder)):
        code, _, said = run("batch", tmp_path / "list.csv", "-o", tmp_path / "out", "--scheduler", address)
    assert code == 0 and "1 of 1 rows are done" in said, said


WRONG = {
    "none": ({}, "tls:// needs certificates"),
    "of another authority": ({"member": "other"}, "do not trust"),
    "the scheduler's is of another authority": ({"authority": "other"}, "do not trust"),
    "a file that is not there": ({"authority": "missing"}, "cannot be read"),
    "without TLS": (None, "tls://"),
}


@pytest.mark.parametrize("case", WRONG)
def test_without_the_right_certificate_it_is_one_line(
    case: str, address: str, folder: Path, refused: Refused, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names, message = WRONG[case]
    if names is None:
        monkeypatch.setattr("avatar_export.batch.cluster.REACHED_S", 0.2)
        address = address.replace("tls", "tcp")
    (tmp_path / "list.csv").write_text("source\na\n")
    with exported(variables(folder, **names) if names else {}):
        said = refused("batch", tmp_path / "list.csv", "-o", tmp_path / "out", "--scheduler", address)
    assert "--scheduler: " in said and message in said and not (tmp_path / "out").exists()
