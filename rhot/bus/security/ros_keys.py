"""The keys of ROS 2 that the bridge uses, for who decides what passes. Pure.

As rmw_zenoh_cpp has them (services/bridges/ros2/keys.py says where that is written). Zenoh's `**`
leaves out parts that begin with `@`: ROS's graph, and how kept topics are caught up with.
"""

from __future__ import annotations

from rhot.files.config import RigConfig

GRAPH, NODE = "@ros2_lv", "rhot_bridge"


def in_rigs_router(config: RigConfig) -> bool:
    """Whether ROS's messages of this rig pass its own router."""
    table = config.bridges.ros2
    return table.enabled and not table.connect


def graph_keys(config: RigConfig) -> list[str]:
    """All of ROS's graph, and of its kept topics."""
    domain = config.bridges.ros2.domain
    return [f"{GRAPH}/{domain}/**", f"{domain}/**/@adv/**"]


def bridge_keys(config: RigConfig) -> list[str]:
    """What the bridge publishes."""
    domain = config.bridges.ros2.domain
    return [f"{domain}/tf/*/*", f"{domain}/tf_static/*/*", f"{domain}/rhot/**"]


def bridge_tokens(config: RigConfig) -> list[str]:
    """By what the bridge is seen in ROS's graph, and its kept topic is found."""
    domain = config.bridges.ros2.domain
    # Zenoh's id, the node's, its own, its kind, ROS's enclave and namespace.
    return [f"{GRAPH}/{domain}/*/*/*/*/*/*/{NODE}/**", *kept_keys(config)]


def kept_keys(config: RigConfig) -> list[str]:
    """Where late subscribers ask for what the bridge keeps for them."""
    return [f"{config.bridges.ros2.domain}/tf_static/*/*/@adv/**"]
