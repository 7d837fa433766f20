"""latency_client.py ENDPOINT COUNT: triggers one observation after the other and prints how long each took, in ms, as JSON."""
import json
import queue
import sys
import time

import zenoh

PATIENCE_S = 60
endpoint, count = sys.argv[1], int(sys.argv[2])
root = "imprint/plant/L1/v1"


def trigger(session):
    """The message Trigger: schema_version 1, the session, observation 0 of 1."""
    name = session.encode()
    return b"\x08\x01\x12" + bytes([len(name)]) + name + b"\x30\x01"


config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", f'["{endpoint}"]')
results, times_ms = queue.Queue(), []
with zenoh.open(config) as session:
    subscriber = session.declare_subscriber(f"{root}/result/*", lambda sample: results.put(str(sample.key_expr)))
    publisher = session.declare_publisher(f"{root}/trigger", express=True)
    time.sleep(1)  # the declarations reach the router
    for index in range(-3, count):  # the first warm up
        name = f"L{index}"
        begin = time.monotonic()
        publisher.put(trigger(name))
        while not results.get(timeout=PATIENCE_S).endswith("/" + name):
            pass
        if index >= 0:
            times_ms.append(1000 * (time.monotonic() - begin))
        time.sleep(0.05)
print(json.dumps(times_ms))
