#!/usr/bin/env python3
"""Video4Linux in a guest with the kernel's vivid driver: tests/boards/vivid_test.cc, then the node itself."""
import pathlib
import sys

import guest

TIMEOUT_S = 900


def main(build):
    kernel = guest.kernel_package.fetch_kernel(guest.CACHE)
    work = guest.CACHE / "vivid"
    work.mkdir(parents=True, exist_ok=True)
    program = pathlib.Path(build) / "tests/boards/vivid_test"
    # multiplanar: 1 is vivid's word for the interface with one plane, 2 for the one with several.
    status = 0
    for planes, tests in (("1", ""), ("2", "'vivid: a ramp*,vivid: a camera that is unplugged*'")):
        script = f"vivid_test --use-colour no --durations yes {tests}\n"
        archive = work / "guest.cpio.gz"
        guest.make_initramfs(archive, kernel, {"vivid": f"n_devs=1 multiplanar={planes}"}, [program], script)
        printed, code, took_s = guest.boot(kernel, archive, work / f"console-{planes}.log", TIMEOUT_S)
        print(printed if code != 0 else printed[printed.rfind("====") :].strip())
        print(f"vivid, multiplanar={planes}: status {code} after {took_s:.0f} s")
        status = status or (0 if code == 0 else 1)
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
