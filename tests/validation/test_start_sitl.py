"""The firmware's start, when the machine is slow or others take its ports."""

import socket
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from e2efly.validation import firmware_program, sitl
from e2efly.validation.sitl import Sitl

LATE = """
#include <arpa/inet.h>
#include <pthread.h>
#include <stdio.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <time.h>
static int listener;
static void *network(void *unused)
{
    for (;;) {
        fd_set readable, writable, odd;
        struct timeval timeout = {0, 10000};
        FD_ZERO(&readable); FD_ZERO(&writable); FD_ZERO(&odd);
        FD_SET(listener, &readable);
        select(listener + 1, &readable, &writable, &odd, &timeout);
    }
    return unused;
}
int main(void)
{
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_port = htons(5761)};
    struct timespec now;
    pthread_t thread;
    listener = socket(AF_INET, SOCK_STREAM, 0);
    bind(listener, (struct sockaddr *)&address, sizeof address);
    listen(listener, 1);
    printf("bind port 5761 for UART1\\n");
    fflush(stdout);
    pthread_create(&thread, NULL, network, NULL);
    for (;;) clock_gettime(CLOCK_MONOTONIC, &now);
}
"""
"""A program whose network thread comes up after its port is open, as the firmware's does on a busy machine."""


def test_a_network_thread_that_comes_late_is_reached(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "late.c").write_text(LATE)
    program = tmp_path / "late"
    subprocess.run(["gcc", "-pthread", "-o", str(program), str(tmp_path / "late.c")], check=True)
    monkeypatch.setattr(sitl, "BOOT_S", 3.0)
    with Sitl(replace(firmware_program.build(), program=program), tmp_path / "run") as started:
        started.advance(0.01)
        started.exchange()


@pytest.mark.parametrize(("kind", "offset"), [(socket.SOCK_STREAM, 4), (socket.SOCK_DGRAM, 2), (socket.SOCK_DGRAM, 3)])
def test_a_port_that_somebody_takes_before_the_start_is_no_matter(
    kind: socket.SocketKind, offset: int, tmp_path: Path
) -> None:
    bench = Sitl(firmware_program.build(), tmp_path)
    with socket.socket(socket.AF_INET, kind) as other:
        other.bind(("127.0.0.1", bench.base + offset))
        taken = bench.base
        with bench:
            assert bench.base != taken
            bench.exchange()
            with socket.create_connection(("127.0.0.1", bench.base + 4), timeout=5.0):
                bench.exchange()


def test_a_port_that_is_taken_while_it_is_off_is_told(tmp_path: Path) -> None:
    """Its link looks for it where it was."""
    with Sitl(firmware_program.build(), tmp_path) as bench:
        bench.advance(0.01)
        bench.stop()
        with socket.socket() as other:
            other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            other.bind(("127.0.0.1", bench.base + 4))
            other.listen()
            with pytest.raises(OSError, match="does not start: its ports are taken by others"):
                bench.start()
