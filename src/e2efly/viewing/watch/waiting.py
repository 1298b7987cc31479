"""A placeholder at the address of the viewer's page. Nothing is imported or computed until a browser requests it."""

from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, HTTPServer
from threading import Event

from e2efly.logs.scripts.origins import refusal

LOOK_S = 0.2
"""Time between two checks whether to continue waiting, s."""
MARK = "e2efly-waiting"
"""Marks this page. The viewer's page does not contain it."""
PAGE = f"""<!doctype html><html><head><meta charset="utf-8"><title>e2efly watch</title></head>
<body id="{MARK}" style="font-family: sans-serif; margin: 3em">
<p>The viewer starts. It takes what the cores leave idle.</p>
<script>
setInterval(async () => {{
  try {{
    const answer = await fetch("/", {{cache: "no-store"}})
    if (!(await answer.text()).includes("{MARK}")) location.reload()
  }} catch {{}}  // between this page and the viewer's nobody answers
}}, 500)
</script></body></html>
""".encode()


def asked_for(host: str, port: int, over: Callable[[], bool]) -> bool:
    """Wait until a browser requests the page. Returns whether one did before `over` became true.

    Args:
        host: address of the page.
        port: port of the page.
        over: returns whether to stop waiting; called every `LOOK_S`.

    Raises:
        OSError: for an address that this machine does not have, or a port in use.
    """
    asked = Event()

    class Waiting(BaseHTTPRequestHandler):
        timeout = 1.0

        def do_GET(self) -> None:
            if why := refusal(self.headers.get_all("Host", []), self.headers.get_all("Origin", []), host):
                return self.send_error(403, explain=why)
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(PAGE)))
            self.send_header("Connection", "close")
            self.end_headers()
            self.wfile.write(PAGE)
            asked.set()

        def log_message(self, format: str, *args: object) -> None:
            del format, args

    with HTTPServer((host, port), Waiting) as server:
        server.timeout = LOOK_S
        while not asked.is_set() and not over():
            server.handle_request()
    return asked.is_set()
