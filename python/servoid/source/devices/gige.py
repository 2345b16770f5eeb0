"""Checks whether a GigE Vision camera is present, with a short timeout."""

import socket

_PORT = 3956  # of GigE Vision's control protocol
_DISCOVERY = bytes.fromhex("4211000200000001")  # key, answer requested, no payload
_ANSWER_S = 0.1


def answers(address: str) -> bool:
    """Return whether a camera answers at an IP address."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.settimeout(_ANSWER_S)
        try:
            channel.connect((address, _PORT))
            channel.send(_DISCOVERY)
            return len(channel.recv(1024)) > 0
        except OSError:  # no camera listens there, or none answered in time
            return False
