"""A Zenoh router as a process of its own: zenoh_router.py ENDPOINT. Ends when it is killed."""
import sys
import threading

import zenoh

config = zenoh.Config()
config.insert_json5("mode", '"router"')
config.insert_json5("listen/endpoints", f'["{sys.argv[1]}"]')
config.insert_json5("scouting/multicast/enabled", "false")
with zenoh.open(config):
    threading.Event().wait()
