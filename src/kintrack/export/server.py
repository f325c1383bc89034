# SPDX-License-Identifier: Apache-2.0
"""One page and the newest message, served to browsers on this machine and to nobody else."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from socket import socket

import tornado.httpserver
import tornado.netutil
import tornado.web
import tornado.websocket

from kintrack.errors import ConfigError

LOOPBACK = "127.0.0.1"
"""The only address that is listened on."""

CONNECT_LIVE = f"ws://{LOOPBACK}:* ws://localhost:*"
"""Where a served page connects to, a Content-Security-Policy source list."""

_HOSTS = r"(127\.0\.0\.1|localhost)"


class PageServer:
    """Serves a page at `/` and messages at the websocket `/frames`.

    A thread of this process does it, so nothing is left over when the process ends. A browser gets
    the newest message whenever it asks for one; what came in between is dropped for it.
    """

    def __init__(self, page: str, port: int | None = None) -> None:
        """Start serving.

        Args:
            page: HTML.
            port: Port on the loopback interface; any free one if None.

        Raises:
            ConfigError: if the port cannot be had.
        """
        try:
            sockets = tornado.netutil.bind_sockets(port or 0, LOOPBACK)
        except (OSError, OverflowError) as error:
            raise ConfigError(
                f"port = {port} cannot be used ({error}); give another, or none for any free one"
            ) from error
        self.url = f"http://{LOOPBACK}:{sockets[0].getsockname()[1]}/"
        """Address of the page."""
        self._browsers: set[_Browser] = set()
        self._beginning: str | None = None
        self._newest: bytes | None = None
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._serve, args=(sockets, page), daemon=True)
        self._thread.start()

    def begin(self, message: str) -> None:
        """Send this text to every browser, now or when it comes; messages follow."""
        self._beginning, self._newest = message, None
        self._in_loop(lambda: self._for_all(self.greet))

    def publish(self, message: bytes) -> None:
        """Send this message to the browsers that wait, and to the others when they ask."""
        self._newest = message
        self._in_loop(lambda: self._for_all(self.feed))

    def close(self) -> None:
        """Stop serving and free the port; doing so twice is harmless."""
        self._in_loop(self._loop.stop)
        self._thread.join()

    def greet(self, browser: _Browser) -> None:
        """Take a browser in; runs in the server's thread."""
        self._browsers.add(browser)
        browser.ready, browser.seen = False, None
        if self._beginning is not None:
            browser.send(self._beginning)

    def feed(self, browser: _Browser) -> None:
        """Send the newest message if it is new to a browser that waits; in the server's thread."""
        message = self._newest
        if browser.ready and message is not None and message is not browser.seen:
            browser.ready, browser.seen = False, message
            browser.send(message)

    def forget(self, browser: _Browser) -> None:
        """Drop a browser that went; runs in the server's thread."""
        self._browsers.discard(browser)

    def _for_all(self, function: Callable[[_Browser], None]) -> None:
        for browser in list(self._browsers):
            function(browser)

    def _in_loop(self, function: Callable[[], None]) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(function)

    def _serve(self, sockets: list[socket], page: str) -> None:
        asyncio.set_event_loop(self._loop)
        application = tornado.web.Application(websocket_max_message_size=1024)
        application.add_handlers(
            _HOSTS, [("/frames", _Browser, {"server": self}), ("/", _Page, {"page": page})]
        )
        server = tornado.httpserver.HTTPServer(application)
        server.add_sockets(sockets)
        self._loop.run_forever()
        server.stop()
        for browser in list(self._browsers):
            browser.close()
        self._loop.run_until_complete(server.close_all_connections())
        self._loop.close()


class _Browser(tornado.websocket.WebSocketHandler):
    """One open page; it asks for a message when it has drawn the last one."""

    ready: bool
    seen: bytes | None

    def initialize(self, server: PageServer) -> None:
        self._server = server

    def open(self, *args: str, **kwargs: str) -> None:
        self.set_nodelay(True)
        self._server.greet(self)

    def on_message(self, message: str | bytes) -> None:
        self.ready = True
        self._server.feed(self)

    def on_close(self) -> None:
        self._server.forget(self)

    def send(self, message: str | bytes) -> None:
        try:
            self.write_message(message, binary=isinstance(message, bytes))
        except tornado.websocket.WebSocketClosedError:
            self._server.forget(self)


class _Page(tornado.web.RequestHandler):
    def initialize(self, page: str) -> None:
        self.page = page

    def get(self) -> None:
        self.set_header("Cache-Control", "no-store")
        self.finish(self.page)
