"""Open a page in headless Chromium, run a script in it, and bring back what it says."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path
from typing import Any

CHROMIUM = (
    shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
)
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-logging=stderr",
    "--virtual-time-budget=4000",
    "--dump-dom",
)
_RUN = """
<script>
window.addEventListener("load", () => setTimeout(() => {
  const out = document.createElement("pre");
  out.id = "said";
  try { out.textContent = JSON.stringify((() => { %s })()); }
  catch (problem) { out.textContent = JSON.stringify({ threw: String(problem) }); }
  document.body.appendChild(out);
}, 300));
</script>
"""


def ask(page: Path, script: str, folder: Path, width: int = 1280) -> tuple[Any, list[str]]:
    """(what the script returns, the browser's console lines); works on a copy in `folder`."""
    assert CHROMIUM
    copy = folder / f"asked-{width}.html"
    copy.write_text(page.read_text("utf-8").replace("</body>", _RUN % script + "</body>"), "utf-8")
    html, console = drawn(copy.as_uri(), folder, width)
    said = re.search(r'<pre id="said">(.*?)</pre>', html, re.S)
    assert said, html[-2000:]
    return json.loads(unescape(said[1])), console


def drawn(address: str, folder: Path, width: int = 1280) -> tuple[str, list[str]]:
    """(the page's HTML after its scripts have run, the browser's console lines)."""
    assert CHROMIUM
    done = subprocess.run(
        [
            CHROMIUM,
            *FLAGS,
            f"--window-size={width},900",
            f"--user-data-dir={folder / 'profile'}",
            address,
        ],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return done.stdout, console
