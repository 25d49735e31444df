"""The local page of `tsvision setup`: 127.0.0.1 only, a random token, no other host."""

from __future__ import annotations

import json
import secrets
import threading
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from tsvision.errors import InputError

HOST = "127.0.0.1"
_MOST_BYTES = 100_000
Answer = Callable[[dict[str, Any]], dict[str, Any]]


class SetupServer:
    """Serves one page and answers its POSTs until `stop()`; each address holds the token.

    `page` is the HTML; `answers` maps a POST's last path element to a function from the fields
    sent to the JSON sent back. An InputError of it comes back as {"problem": …}.
    """

    def __init__(self, page: str, answers: dict[str, Answer], port: int = 0) -> None:
        self.token = secrets.token_urlsafe(18)
        try:
            self._server = ThreadingHTTPServer((HOST, port), _handler(self, page, answers))
        except OSError as problem:
            raise InputError(
                f"port {port} on {HOST} cannot be used ({problem.strerror}); choose another --port"
            ) from None
        self._server.daemon_threads = True

    @property
    def port(self) -> int:
        """The port in use."""
        return int(self._server.server_address[1])

    @property
    def address(self) -> str:
        """The page's address, token included: give it to nobody else."""
        return f"http://{HOST}:{self.port}/{self.token}/"

    def serve(self) -> None:
        """Answer until `stop()` is called from another thread, or Ctrl-C."""
        try:
            self._server.serve_forever(poll_interval=0.1)
        finally:
            self._server.server_close()

    def stop(self) -> None:
        """End `serve()` soon; may be called while a request is answered."""
        threading.Thread(target=self._server.shutdown, daemon=True).start()


def _answer(work: Answer, fields: dict[str, Any]) -> dict[str, Any]:
    try:
        return work(fields)
    except InputError as problem:
        return {"problem": str(problem)}
    except Exception as fault:  # told on the page, which goes on; a dead thread would be silent
        words = " ".join(str(fault).split())[:200]
        kind = type(fault).__name__
        return {"problem": f"the program failed ({kind}: {words}); try another frame or region"}


def _handler(
    owner: SetupServer, page: str, answers: dict[str, Answer]
) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        server_version, sys_version = "tsvision", ""

        def do_GET(self) -> None:
            if self._trusted() and self.path == f"/{owner.token}/":
                self._send(200, "text/html; charset=utf-8", page.encode("utf-8"))
            else:
                self._send(404, "text/plain", b"not found")

        def do_POST(self) -> None:
            name = self.path.removeprefix(f"/{owner.token}/")
            if not self._trusted() or name == self.path or name not in answers:
                self._send(404, "text/plain", b"not found")
                return
            fields = self._fields()
            if fields is None:
                self._send(400, "text/plain", b"one small JSON object is expected")
                return
            reply = json.dumps(_answer(answers[name], fields))
            self._send(200, "application/json", reply.encode("utf-8"))

        def _trusted(self) -> bool:
            """Only this machine's own names: a page elsewhere that resolves its name to
            127.0.0.1 sends another Host, one that posts across sends another Origin."""
            here = {f"{name}:{owner.port}" for name in (HOST, "localhost")}
            origin = self.headers.get("Origin")
            same = origin is None or origin.removeprefix("http://") in here
            return self.headers.get("Host") in here and same

        def _fields(self) -> dict[str, Any] | None:
            length = self.headers.get("Content-Length") or ""
            if not length.isdecimal() or int(length) > _MOST_BYTES:
                return None
            try:
                value = json.loads(self.rfile.read(int(length)))
            except (ValueError, RecursionError):
                return None
            return value if isinstance(value, dict) else None

        def _send(self, status: int, kind: str, body: bytes) -> None:
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(body)))
            self.send_header("Cache-Control", "no-store")
            self.send_header("X-Content-Type-Options", "nosniff")
            self.send_header("Referrer-Policy", "no-referrer")
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: Any) -> None:
            """Quiet: the address in a log would hold the token."""

    return Handler
