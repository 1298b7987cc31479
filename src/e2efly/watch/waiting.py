"""A page that stands where the viewer's will: until a browser asks for it, nothing is imported or computed."""

from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, HTTPServer
from threading import Event

LOOK_S = 0.2
"""Between two looks whether it is still to wait, s."""
MARK = "e2efly-waiting"
"""Of this page; the viewer's has none."""
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
    """Wait until a browser asks for the page; whether one did before it was over.

    Args:
        host: address of the page.
        port: of the page.
        over: whether to wait no longer; asked every `LOOK_S`.

    Raises:
        OSError: for an address that this machine does not have, or a port in use.
    """
    asked = Event()

    class Waiting(BaseHTTPRequestHandler):
        timeout = 1.0

        def do_GET(self) -> None:
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
