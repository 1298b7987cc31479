"""The port of the page. Imports neither JAX nor viser, because a bridge and a training use it, too."""

import errno
import importlib.util
import socket


def free_port(host: str, port: int) -> int:
    """The given port, or a free port for 0.

    Raises:
        ValueError: when viser is not installed, or when the port is in use.
        OSError: for an address that this machine does not have.
    """
    if importlib.util.find_spec("viser") is None:
        raise ValueError("the viewer needs viser; accepted: pip install 'e2efly[watch]'")
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                raise ValueError(f"--port {port} is in use on {host}; accepted: a free one, or 0 for any") from None
            raise OSError(f"--host {host}, --port {port}: {error.strerror}") from error
        return probe.getsockname()[1]
