"""rhot-recorder: records every session (or always: [recorder] autostart) as MCAP."""

from __future__ import annotations

from rhot.process.lifecycle import command
from rhot.process.threads.allocator import keep_large_blocks_apart


def main() -> None:
    """Entry point of rhot-recorder."""
    on_request = (
        "serve_on_request",
        "record only what the page asks for, unless [recorder] autostart",
    )
    keep_large_blocks_apart()
    command("recorder", "services.recorder.service", __doc__, variants={"on-request": on_request})


if __name__ == "__main__":
    main()
