"""A client that means no good: hostile_client.py ENDPOINT MESSAGES IMPRINT. Sends on every camera's keys and on the trigger's."""
import os
import random
import sys

import zenoh

endpoint, messages, imprint = sys.argv[1], int(sys.argv[2]), open(sys.argv[3], "rb").read()
root = "imprint/plant/L1/v1"
keys = [f"{root}/cam/{camera}/{leaf}" for camera in ("cam1", "cam2", "cam9", "..%2f") for leaf in ("imprint", "health", "delivery")]
keys += [f"{root}/trigger", f"{root}/fusion/service/status"]
chance = random.Random(1)


def damaged():
    content = bytearray(imprint)
    for _ in range(chance.randrange(1, 20)):
        content[chance.randrange(len(content))] = chance.randrange(256)
    return bytes(content)


KINDS = [lambda: os.urandom(chance.randrange(0, 5000)), damaged, lambda: imprint[: chance.randrange(len(imprint))],
         lambda: b"\x08\x00" + imprint[2:],                     # schema version 0
         lambda: imprint + b"\xfa\x3e\x05later",                # fields of a later schema
         lambda: b"\x08\xff\xff\xff\xff\x0f" + imprint[2:],     # a schema version far ahead
         lambda: b""]

config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", f'["{endpoint}"]')
with zenoh.open(config) as session:
    for key in keys:
        session.put(key, b"\x08\x01" + bytes(10_000_000), congestion_control=zenoh.CongestionControl.BLOCK)
    for index in range(messages):
        session.put(chance.choice(keys), chance.choice(KINDS)(), congestion_control=zenoh.CongestionControl.BLOCK)
