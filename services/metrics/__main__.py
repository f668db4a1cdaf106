"""rhot-metrics: the rig's health for Prometheus, over HTTP."""

from __future__ import annotations

from rhot.process.lifecycle import command


def main() -> None:
    """Entry point of rhot-metrics."""
    command("metrics", "services.metrics.service", __doc__)


if __name__ == "__main__":
    main()
