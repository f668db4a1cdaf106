"""Joint positions to a game engine or a sketch: one JSON datagram a pose, to UDP port 9000."""

import json
import socket
import sys

import rhot

PORT = int(sys.argv[2]) if len(sys.argv) > 2 else 9000


def main() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp, rhot.open(*sys.argv[1:2]) as rig:
        for count, pose in enumerate(rig.hand_poses()):
            joints = {joint.name: joint.position_m for joint in pose.joints}
            datagram = {"hand": pose.hand, "stamp_ns": pose.stamp_ns, "joints_m": joints}
            udp.sendto(json.dumps(datagram).encode(), ("127.0.0.1", PORT))
            if count % 30 == 0:
                print(f"{count + 1} poses sent to 127.0.0.1:{PORT}", flush=True)


main()
