"""The five codecs of a pack's sections: both directions, by hand, and against data that does not fit."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_runtime.codec.sections import decode, encode, incidence
from avatar_runtime.io.errors import AvatarError
from tests.session.fuzz import examples

KINDS = {8: np.uint8, 16: np.uint16, 32: np.uint32}


@pytest.mark.parametrize(
    ("codec", "record", "elements", "stored"),
    [
        ("raw", 1, np.array([1, 0x0203], np.uint16), "0100 0302"),
        ("planes", 1, np.array([0x0102, 0x0304], np.uint16), "0204 0103"),
        ("planes", 3, np.array([1, 2, 3, 4, 5, 6], np.uint8), "0104 0205 0306"),
        ("delta", 1, np.array([3, 5, 4], np.uint8), "03 02 ff"),
        ("delta", 1, np.array([0x0100, 0x00FF], np.uint16), "00ff 01ff"),
        ("pointer", 1, np.array([0, 2, 2, 5], np.uint32), "02 00 03"),
        ("pointer", 1, np.array([0, 256, 258], np.uint32), "0002 0100"),
        ("pointer", 1, np.array([0], np.uint32), ""),
    ],
)
def test_stored_bytes(codec: str, record: int, elements: np.ndarray, stored: str) -> None:
    data = encode(elements, codec, record)
    assert data.hex() == stored.replace(" ", "")
    got = decode(memoryview(data), codec, 8 * elements.itemsize, len(elements), record, "x")
    assert got.dtype == elements.dtype and got.tolist() == elements.tolist()


@given(
    st.sampled_from(["raw", "planes", "delta"]),
    st.sampled_from([8, 16, 32]),
    st.integers(1, 5),
    st.integers(0, 30),
    st.randoms(use_true_random=False),
)
@settings(max_examples=examples(200))
def test_what_is_stored_comes_back(codec: str, bits: int, record: int, rows: int, random: Random) -> None:
    rng = np.random.default_rng(random.getrandbits(32))
    elements = rng.integers(0, 1 << bits, rows * record, dtype=np.uint64).astype(KINDS[bits])
    data = memoryview(encode(elements, codec, record))
    assert decode(data, codec, bits, len(elements), record, "x").tolist() == elements.tolist()


@pytest.mark.parametrize(
    ("codec", "bits", "count", "record", "size", "message"),
    [
        ("raw", 16, 3, 1, 5, "stores 5 bytes; 3 elements of 16 bits take 6"),
        ("planes", 8, 4, 3, 4, "has 4 elements, which are no whole records of 3"),
        ("delta", 32, 2, 1, 7, "stores 7 bytes"),
        ("pointer", 32, 4, 1, 4, "stores 4 bytes for 3 counts"),
        ("pointer", 32, 0, 1, 0, "stores 0 bytes for -1 counts"),
    ],
)
def test_data_that_does_not_fit_is_refused(
    codec: str, bits: int, count: int, record: int, size: int, message: str
) -> None:
    with pytest.raises(AvatarError, match=message):
        decode(memoryview(bytes(size)), codec, bits, count, record, "buffer b, section s")


def test_counts_beyond_32_bits_and_corners_out_of_range_are_refused() -> None:
    with pytest.raises(AvatarError, match=r"counts more than 2\^32 entries"):
        decode(memoryview(b"\xff" * 8), "pointer", 32, 3, 1, "x")
    with pytest.raises(AvatarError, match="corners that are none of the 3 vertices"):
        incidence(np.array([0, 1, 3], np.uint8), 3, "x")
