"""The networks that look at a film: that they ask no other machine for anything."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from tests.session.needed import need

# In the place of the C library's functions, for all code of the process.
SHIM = r"""
#define _GNU_SOURCE
#include <netdb.h>
#include <stdio.h>
int getaddrinfo(const char *node, const char *service, const struct addrinfo *hints, struct addrinfo **found) {
    (void)service, (void)hints, (void)found;
    FILE *told = fopen(TOLD, "a");
    fprintf(told, "%s\n", node ? node : "");
    fclose(told);
    return EAI_FAIL;
}
"""
LOOK = """
import sys, time
import numpy as np
from avatar_trainer.film.networks import Networks

end = time.monotonic() + 2  # MediaPipe 0.10.35 asked within one second
with Networks() as networks:
    while time.monotonic() < end:
        networks.face(np.zeros((64, 64, 3), np.uint8))
        networks.person(np.zeros((64, 64, 3), np.uint8))
if len(sys.argv) > 1:
    import socket
    try:
        socket.getaddrinfo("asked.invalid", 443)
    except OSError:
        pass
"""


def test_nobody_is_asked(tmp_path: Path) -> None:
    need({"cc": shutil.which("cc"), "Linux": sys.platform == "linux"})
    told, source, shim = tmp_path / "told", tmp_path / "shim.c", tmp_path / "shim.so"
    source.write_text(SHIM)
    define = f'-DTOLD="{told}"'
    subprocess.run(["cc", "-shared", "-fPIC", define, "-o", str(shim), str(source)], check=True)
    environment = {**os.environ, "LD_PRELOAD": str(shim)}
    subprocess.run([sys.executable, "-c", LOOK], env=environment, check=True, capture_output=True)
    assert not told.exists()
    subprocess.run([sys.executable, "-c", LOOK, "ask"], env=environment, check=True, capture_output=True)
    assert told.read_text() == "asked.invalid\n"  # the shim sees who asks
