"""A page on which a person clicks on the joints of the first picture; on this machine only.

The page is served at 127.0.0.1 under a path that only its address tells, until it has answered.
"""

from __future__ import annotations

import html
import secrets
from collections.abc import Callable, Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, HTTPServer
from typing import Any

import cv2

from rhot.errors import CaptureError
from services.pi_tracker.image.frame import Image
from studies.grasp.measure.seeds import Method, Seeds, decode_seeds

_PLACES: dict[bool, tuple[str, ...]] = {
    True: (
        *("index_wrist", "index_mcp", "index_pip", "index_dip", "index_tip"),
        *("thumb_cmc", "thumb_mp", "thumb_ip", "thumb_tip"),
    ),
    False: ("index_b1", "index_b2", "index_mcp", "index_pip", "index_dip", "index_tip"),
}
# Nine clicks are a few hundred bytes.
_LARGEST_BODY = 10_000
_PAGE = """<!doctype html><meta charset="utf-8"><title>joints</title>
<style>body{{font:16px sans-serif;margin:12px}}#p{{position:relative;display:inline-block}}
#p img{{max-width:98vw;cursor:crosshair}}.d{{position:absolute;width:10px;height:10px;
margin:-6px 0 0 -6px;border:2px solid #fff;outline:1px solid #000;border-radius:50%;
pointer-events:none}}.d span{{position:absolute;left:12px;top:-8px;background:#000a;color:#fff;
padding:0 3px;white-space:nowrap}}</style>
<p id="say"></p><p><button id="skip">there is none</button> <button id="back">take back</button>
<button id="done">done</button></p><div id="p"><img id="i" src="picture.png"></div>
<script>
const places = {places}, answers = [];
const say = document.getElementById("say"), box = document.getElementById("p");
const img = document.getElementById("i");
function show() {{
  box.querySelectorAll(".d").forEach(d => d.remove());
  for (const [name, at] of answers) if (at) {{
    const d = document.createElement("div"), s = document.createElement("span");
    d.className = "d"; s.textContent = name; d.append(s);
    d.style.left = 100 * at[0] / img.naturalWidth + "%";
    d.style.top = 100 * at[1] / img.naturalHeight + "%"; box.append(d);
  }}
  const next = places[answers.length];
  say.textContent = next ? "Click on " + next.replace("_", " ") : "All clicked: press done.";
}}
img.onclick = e => {{
  const r = img.getBoundingClientRect(), k = img.naturalWidth / r.width;
  if (answers.length < places.length)
    answers.push([places[answers.length], [(e.clientX - r.left) * k, (e.clientY - r.top) * k]]);
  show();
}};
document.getElementById("skip").onclick = () => {{
  if (answers.length < places.length) answers.push([places[answers.length], null]);
  show();
}};
document.getElementById("back").onclick = () => {{ answers.pop(); show(); }};
document.getElementById("done").onclick = async () => {{
  const seeds = Object.fromEntries(answers.filter(a => a[1]));
  const told = await fetch("seeds", {{method: "POST", body: JSON.stringify(seeds)}});
  say.textContent = await told.text();
}};
show();
</script>"""


class ClickServer(HTTPServer):
    """Serves the page; seeds are there once it was answered."""

    def __init__(self, image: Image, method: Method) -> None:
        """image: (h, w, 3), the first picture as the camera saw it."""
        good, png = cv2.imencode(".png", image)
        if not good:
            raise CaptureError("the first picture cannot be shown: OpenCV writes no PNG here")
        self.picture = png.tobytes()
        names = ", ".join(f'"{place}"' for place in _PLACES[method == "dots"])
        self.page = _PAGE.format(places=f"[{names}]").encode()
        self.path = f"/{secrets.token_urlsafe(12)}/"
        self.seeds: Seeds = {}
        super().__init__(("127.0.0.1", 0), _Handler)

    @property
    def address(self) -> str:
        """What to open in a browser."""
        return f"http://127.0.0.1:{self.server_address[1]}{self.path}"


class _Handler(BaseHTTPRequestHandler):
    server: ClickServer
    # A browser that opens a connection and says nothing must not hold up the rest.
    timeout = 5.0

    def do_GET(self) -> None:
        content = {"": ("text/html", self.server.page), "picture.png": ("image/png", b"")}
        name = self._name()
        if name is None or name not in content:
            self._answer(HTTPStatus.NOT_FOUND, "text/plain", b"nothing here")
            return
        kind, body = content[name]
        self._answer(HTTPStatus.OK, kind, body or self.server.picture)

    def do_POST(self) -> None:
        length = self.headers.get("Content-Length", "")
        if self._name() != "seeds" or not length.isdecimal() or int(length) > _LARGEST_BODY:
            self._answer(HTTPStatus.NOT_FOUND, "text/plain", b"nothing here")
            return
        try:
            seeds = decode_seeds(self.rfile.read(int(length)), "the page")
        except CaptureError as error:
            self._answer(HTTPStatus.BAD_REQUEST, "text/plain", html.escape(str(error)).encode())
            return
        if not seeds:
            self._answer(HTTPStatus.BAD_REQUEST, "text/plain", b"Click on two joints at least.")
            return
        self.server.seeds = seeds
        self._answer(HTTPStatus.OK, "text/plain", b"Thank you; this page may be closed.")

    def _name(self) -> str | None:
        """What is asked for below the page's own path."""
        path = self.server.path
        return self.path.removeprefix(path) if self.path.startswith(path) else None

    def _answer(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - http.server's name
        """Nothing: the command speaks for itself."""


def clicked(image: Image, method: Method, say: Callable[[str], None]) -> Seeds:
    """The joints that a person clicks on; waits for that. say tells the page's address."""
    with ClickServer(image, method) as server:
        say(f"open {server.address} in a browser on this machine and click on the joints")
        while not server.seeds:
            server.handle_request()
        return server.seeds


def as_options(seeds: Seeds) -> str:
    """The same seeds as options of the command, to be used again."""
    pairs: Sequence[str] = [f"--seed {place}={x:.0f},{y:.0f}" for place, (x, y) in seeds.items()]
    return " ".join(pairs)
