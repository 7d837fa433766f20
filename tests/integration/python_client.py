#!/usr/bin/env python3
"""An independent client: subscribes to imprints over Zenoh, decodes them, compares them with what is expected.

Shares nothing with the C++ code but proto/imprint.proto: the message classes are those protoc generates from it,
the curves are unpacked as its comments say.

Exit status: 0 an imprint came and is as expected; 1 none came in time, or it differs (each difference is a line
on stderr). The expectation is a JSON object; only what it names is compared:
  {"camera_id": "cam1", "session": "s", "observation": 0, ...,        any scalar field of Imprint
   "max_bytes": 4096,
   "curves": {"upper": {"offset_px": [...], "weight": [...]}, ...},    offsets are compared where weight > 0
   "offset_tolerance_px": 0.002, "weight_tolerance": 0.002}
"""

import argparse
import importlib
import json
import queue
import sys


class Bits:
    """The bits of some bytes, most significant first."""

    def __init__(self, data):
        self.bits = "".join(f"{byte:08b}" for byte in data)
        self.position = 0

    def take(self, count):
        if self.position + count > len(self.bits):
            raise ValueError("the bytes end too soon")
        bits = self.bits[self.position:self.position + count]
        self.position += count
        return int(bits, 2) if bits else 0

    def exp_golomb(self, k):
        zeros = 0
        while self.take(1) == 0:
            zeros += 1
        q = (1 << zeros) | self.take(zeros)
        return ((q - 1) << k) | self.take(k)


def unpack(data, count, base):
    """The integers of "packing 1", see message Curve."""
    bits = Bits(data)
    values = [base, base]  # v[-2], v[-1]
    while len(values) < count + 2:
        order, k = bits.take(2), bits.take(5)
        for _ in range(min(25, count + 2 - len(values))):
            folded = bits.exp_golomb(k)
            residual = folded // 2 if folded % 2 == 0 else -(folded + 1) // 2
            predicted = (base, values[-1], 2 * values[-1] - values[-2])[order]
            values.append(predicted + residual)
    return values[2:]


def unpack_curve(curve):
    """(offsets in px, weights) of a Curve."""
    if curve.stations and curve.packing != 1:
        raise ValueError(f"expected packing 1, found {curve.packing}")
    offsets = unpack(curve.offsets, curve.stations, curve.offset_base)
    weights = unpack(curve.weights, curve.stations, curve.weight_levels // 2)
    return ([v * curve.offset_step_px for v in offsets], [v / curve.weight_levels for v in weights])


def compare_curve(name, curve, expected, offset_tolerance_px, weight_tolerance):
    """Lines telling how a curve differs from what is expected."""
    offsets, weights = unpack_curve(curve)
    if len(offsets) != len(expected["offset_px"]):
        return [f"{name}: expected {len(expected['offset_px'])} stations, found {len(offsets)}"]
    differences = []
    rows = zip(offsets, weights, expected["offset_px"], expected["weight"])
    for i, (offset, weight, wanted_offset, wanted_weight) in enumerate(rows):
        if abs(weight - wanted_weight) > weight_tolerance or (weight > 0) != (wanted_weight > 0):
            differences.append(f"{name}[{i}]: expected weight {wanted_weight}, found {weight}")
        if wanted_weight > 0 and abs(offset - wanted_offset) > offset_tolerance_px:
            differences.append(f"{name}[{i}]: expected {wanted_offset} px, found {offset} px")
    return differences


def compare(message, size_bytes, expected):
    """Lines telling how an imprint differs from what is expected."""
    differences = []
    not_fields = {"curves", "max_bytes", "offset_tolerance_px", "weight_tolerance"}
    for field in expected.keys() - not_fields:
        if getattr(message, field) != expected[field]:
            differences.append(f"{field}: expected {expected[field]!r}, found {getattr(message, field)!r}")
    if size_bytes > expected.get("max_bytes", 4096):
        differences.append(f"expected at most {expected.get('max_bytes', 4096)} bytes, found {size_bytes}")
    for name, curve in expected.get("curves", {}).items():
        differences += compare_curve(name, getattr(message, name), curve, expected.get("offset_tolerance_px", 0.002),
                                     expected.get("weight_tolerance", 0.002))
    return differences


def receive(connect, key, timeout_s):
    """(key, payload) of the first sample, or None when none comes in time."""
    import zenoh  # not at the top: --help works without it

    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([connect]))
    config.insert_json5("scouting/multicast/enabled", "false")
    samples = queue.Queue()
    with zenoh.open(config) as session:
        subscriber = session.declare_subscriber(
            key, lambda sample: samples.put((str(sample.key_expr), sample.payload.to_bytes())))
        try:
            return samples.get(timeout=timeout_s)
        except queue.Empty:
            return None
        finally:
            subscriber.undeclare()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--connect", required=True, help="endpoint of a router, e.g. tcp/127.0.0.1:7447")
    parser.add_argument("--key", required=True, help="key expression, e.g. imprint/site/line/v1/cam/*/imprint")
    parser.add_argument("--expect", required=True, help="JSON file, see above")
    parser.add_argument("--generated", required=True, help="folder of imprint_pb2.py, made by protoc --python_out")
    parser.add_argument("--timeout-s", type=float, default=20.0)
    args = parser.parse_args()

    sys.path.insert(0, args.generated)
    imprint_pb2 = importlib.import_module("imprint_pb2")
    with open(args.expect, encoding="utf-8") as file:
        expected = json.load(file)

    received = receive(args.connect, args.key, args.timeout_s)
    if received is None:
        print(f"python_client: {args.key}: expected an imprint within {args.timeout_s} s, found none", file=sys.stderr)
        return 1
    key, payload = received
    differences = compare(imprint_pb2.Imprint.FromString(payload), len(payload), expected)
    for difference in differences[:20]:
        print(f"python_client: {key}: {difference}", file=sys.stderr)
    if not differences:
        print(f"python_client: {key}: {len(payload)} bytes, all as expected")
    return 1 if differences else 0


if __name__ == "__main__":
    sys.exit(main())
