from rhot import topics
from rhot.bus.stats import StreamStats, percentiles_ms


def test_a_beat_reports_and_starts_anew():
    stats = StreamStats(topics.POSE, "rhot/desk/hand/right/pose", {"hand": "right"}, "in")
    stats.count, stats.dropped, stats.rejected = 27, 2, 1
    stats.latencies_ns.extend([1_000_000, 2_000_000, 3_000_000])
    health = stats.beat(1.0, 30.0)
    assert (health.count, health.rate_hz, health.dropped, health.rejected, health.ok) == (
        27,
        27.0,
        2,
        1,
        True,
    )
    assert (health.latency_p50_ms, health.latency_p99_ms) == (2.0, 3.0)
    empty = stats.beat(1.0, 30.0)
    assert (empty.count, empty.ok, empty.latency_p50_ms) == (0, False, -1.0)


def test_a_stream_without_expectation_is_always_ok():
    assert StreamStats(topics.SESSION, "k", {}, "out").beat(1.0, 0.0).ok


def test_percentiles_of_nothing():
    assert percentiles_ms([]) == (-1.0, -1.0)
