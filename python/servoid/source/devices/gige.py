"""Asks a camera of GigE Vision whether it is there, without waiting long for an answer."""

import socket

_PORT = 3956  # of GigE Vision's control protocol
_DISCOVERY = bytes.fromhex("4211000200000001")  # a key, a request to be answered, no content
_ANSWER_S = 0.1


def answers(address: str) -> bool:
    """Return whether a camera answers at an internet address."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.settimeout(_ANSWER_S)
        try:
            channel.connect((address, _PORT))
            channel.send(_DISCOVERY)
            return len(channel.recv(1024)) > 0
        except OSError:  # nobody listens there, or nobody answered in time
            return False
