"""A camera in the network, made for a test: OpenCV opens it as it opens a device, and it is really unplugged."""

from __future__ import annotations

import contextlib
import itertools
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import cv2
import numpy as np
from small_videos import HEIGHT_PX, STEP, WIDTH_PX

BOUNDARY = b"--picture\r\n"


class NetworkCamera:
    """Serves pictures one after the other, of grey level 0, 40, … 200, 0, …

    Attributes:
        address: Where OpenCV finds it.
        unplugged: Set: it ends.
    """

    def __init__(self, rate_hz: float) -> None:
        self.unplugged, self._pause_s = threading.Event(), 1.0 / rate_hz
        camera = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                self.send_response(200)
                self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=picture")
                self.end_headers()
                with contextlib.suppress(OSError):  # its viewer has gone
                    for number in itertools.count():
                        if camera.unplugged.wait(camera._pause_s):
                            return
                        self.wfile.write(_part(number % 6))

            def log_message(self, *_about: Any) -> None:
                """Say nothing."""

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.address = f"http://127.0.0.1:{self.server.server_port}/video.mjpg"


def _part(number: int) -> bytes:
    grey = np.full((HEIGHT_PX, WIDTH_PX), STEP * number, np.uint8)
    jpeg = cv2.imencode(".jpg", grey)[1].tobytes()
    return b"%sContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%s\r\n" % (BOUNDARY, len(jpeg), jpeg)


@contextlib.contextmanager
def network_camera(rate_hz: float = 20.0) -> Iterator[NetworkCamera]:
    """Run a camera, to the end of the block."""
    camera = NetworkCamera(rate_hz)
    serving = threading.Thread(target=camera.server.serve_forever, args=(0.05,), daemon=True)
    serving.start()
    try:
        yield camera
    finally:
        camera.unplugged.set()
        camera.server.shutdown()
        camera.server.server_close()
        serving.join()
