"""The HTML that viser's client is served in, as the page of a rig. Pure.

viser's own says "Viser" on the browser's tab, its notices lie where the fingers are, and its sheet
of controls on a phone is as narrow as a desktop's and open at first, over the hand. What stands in
place of its title changes that, and headers let the browser load and ask nothing from anywhere
else.
"""

from __future__ import annotations

import re

# Coloured markers on a fingertip's arc.
_ICON = (
    "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 32 32'%3E"
    "%3Cpath d='M5 25 Q10 6 27 7' fill='none' stroke='%23888' stroke-width='4'/%3E"
    "%3Ccircle cx='5' cy='25' r='5' fill='%230072b2'/%3E%3Ccircle cx='13' cy='12' r='5'"
    " fill='%23009e73'/%3E%3Ccircle cx='26' cy='7' r='5' fill='%23e69f00'/%3E%3C/svg%3E"
)
_TITLE, _VISERS_ICON = "<title>Viser</title>", re.compile(r'<link\s+rel="icon"\s[^>]*>')
# Below this width viser shows its controls as a sheet at the bottom (its theme's breakpoint xs).
_PHONE = "(max-width: 36em)"
# Notices, as of a browser without a graphics card: in the lower corner, below the hand, above a
# phone's closed sheet and under its open one. The sheet: as wide as the screen, at most half as
# high, so that the hand stays in view.
_STYLE = """
.mantine-Notifications-root[data-position^="top"] {
  top: auto !important; bottom: 4em !important; z-index: 5 !important;
}
@media PHONE {
  .mantine-ScrollArea-root[style*="position: fixed"],
  .mantine-Paper-root[style*="position: fixed"] {
    width: 100% !important; max-height: 50% !important;
  }
  .mantine-Paper-root[style*="position: fixed"] div[style*="width: 20em"] {
    width: 100% !important;
  }
}
"""
# Closes the sheet once, as soon as it is there: its handle opens it again.
_SCRIPT = """
if (matchMedia("PHONE").matches) {
  const watch = new MutationObserver(() => {
    const handle = document.querySelector(
      '.mantine-Paper-root[style*="position: fixed"] [style*="cursor: pointer"]');
    if (handle) { watch.disconnect(); handle.click(); }
  });
  watch.observe(document, {childList: true, subtree: true});
}
"""
# Everything of the page is in the page: the client, its images, fonts, workers and WebAssembly.
# Its parts are unpacked by a script in the page itself, hence inline and eval.
_POLICY = (
    "default-src 'self' data: blob: 'unsafe-inline' 'unsafe-eval'; frame-ancestors 'none'; "
    "form-action 'none'; base-uri 'none'"
)
HEADERS = {
    "Content-Security-Policy": _POLICY,
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-cache",
}


def front_page(html: str) -> str:
    """viser's index.html as the page of a rig."""
    style, script = _STYLE.replace("PHONE", _PHONE), _SCRIPT.replace("PHONE", _PHONE)
    own = f'<title>rhot</title><link rel="icon" href="{_ICON}">'
    html = _VISERS_ICON.sub("", html, count=1)
    return html.replace(_TITLE, f"{own}<style>{style}</style><script>{script}</script>", 1)
