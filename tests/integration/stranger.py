"""A client that knows the plant's authority and has no certificate: stranger.py HOST:PORT CA. Says "refused" when it is."""
import socket
import ssl
import sys

host, port = sys.argv[1].split(":")
context = ssl.create_default_context(cafile=sys.argv[2])
with socket.create_connection((host, int(port)), timeout=10) as plain, context.wrap_socket(plain, server_hostname=host) as link:
    link.settimeout(10)
    try:
        link.sendall(b"\x00" * 16)
        print("let in" if link.recv(1) else "refused")
    except ssl.SSLError as error:  # TLS 1.3 tells after the handshake
        print(f"refused: {error.reason}")
