"""The faults a plant has, each done to a line of real processes. Every function fails on a loss and gives its figures."""
import contextlib
import datetime
import itertools
import json
import os
import pathlib
import random
import re
import signal
import statistics
import subprocess
import threading
import time

from ready_imprints import ReadyLine
from running_line import CAMERAS, PATIENCE_S, free_port, imprint

HERE = pathlib.Path(__file__).resolve().parent


def sessions_of(count):
    return [f"S{index:03}" for index in range(count)]


def kills(work, ready, python, observations, kill_count, seed=1):
    """kill -9 of a node, fusion or the router between them at random moments while observations are triggered."""
    chance = random.Random(seed)
    with ReadyLine(work, ready, deadline_s=2 * PATIENCE_S, retry_s=1.0) as line:
        line.start("router", [python, HERE / "zenoh_router.py", line.endpoint])
        line.start_fusion("--set", "zenoh.listen=[]", "--set", f'zenoh.connect=["{line.endpoint}"]')
        line.start_nodes(*CAMERAS)
        line.wait_alive(*CAMERAS)
        sessions, taken, failure = sessions_of(observations), itertools.count(1), []
        progress = 0

        def trigger_all():
            nonlocal progress
            try:
                for session in sessions:
                    line.trigger_until_taken(session)
                    progress = next(taken)
            except AssertionError as error:
                failure.append(error)

        operator = threading.Thread(target=trigger_all)
        operator.start()
        killed = dict.fromkeys(("cam1", "cam2", "cam3", "fusion", "router"), 0)
        for index in range(kill_count):
            while operator.is_alive() and progress < index * observations // kill_count:
                time.sleep(0.02)
            time.sleep(chance.uniform(0, 0.5))
            victim = chance.choice(sorted(killed))
            line.end(victim, signal.SIGKILL)
            killed[victim] += 1
            time.sleep(chance.uniform(0, 0.3))
            line.start_again(victim)
        operator.join()
        if failure:
            raise failure[0]
        line.wait_for_results(sessions, 3 * PATIENCE_S)
        account = line.account()
        assert account["results"] == observations, account
        return {"observations": observations, "kills": killed, **account}


class Cable:
    """The nodes' own network namespace, joined to this one by a cable that can be cut or made to lose packets."""

    def __init__(self):
        self.name = f"imp{os.getpid()}"
        self.here, self.there = "10.231.77.1", "10.231.77.2"

    def run(self, *command):
        subprocess.run(["ip", *map(str, command)], check=True, capture_output=True)

    def inside(self, *command):
        return ["ip", "netns", "exec", self.name, *map(str, command)]

    def __enter__(self):
        self.run("netns", "add", self.name)
        try:
            self.run("link", "add", self.name, "type", "veth", "peer", "name", "eth0", "netns", self.name)
            self.run("addr", "add", f"{self.here}/24", "dev", self.name)
            self.run("link", "set", self.name, "up")
            self.run("-n", self.name, "addr", "add", f"{self.there}/24", "dev", "eth0")
            self.run("-n", self.name, "link", "set", "eth0", "up")
            self.run("-n", self.name, "link", "set", "lo", "up")
        except subprocess.CalledProcessError:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        subprocess.run(["ip", "link", "del", self.name], check=False, capture_output=True)
        subprocess.run(["ip", "netns", "del", self.name], check=False, capture_output=True)

    @contextlib.contextmanager
    def cut(self):
        self.run("link", "set", self.name, "down")
        try:
            yield
        finally:
            self.run("link", "set", self.name, "up")

    def lose(self, percent):
        """Drops that share of the packets of either direction."""
        chains = [f"chain {hook} {{\ntype filter hook {hook} priority 0\nnumgen random mod 100 < {percent} drop\n}}\n"
                  for hook in ("input", "output")]
        rules = "table inet loss {\n" + "".join(chains) + "}\n"
        subprocess.run(self.inside("nft", "-f", "-"), input=rules, text=True, check=True, capture_output=True)


    def limit(self, rate):
        """Lets through only so much each way, e.g. 64kbit; what does not fit waits for up to 4 s."""
        shape = ["qdisc", "add", "dev", None, "root", "tbf", "rate", rate, "burst", "2000", "latency", "4s"]
        for prefix, device in (([], self.name), (["ip", "netns", "exec", self.name], "eth0")):
            subprocess.run([*prefix, "tc", *(part or device for part in shape)], check=True, capture_output=True)


class CabledLine(ReadyLine):
    """Fusion here, the nodes at the other end of the cable."""

    def __init__(self, work, ready, cable, **settings):
        super().__init__(work, ready, **settings)
        self.cable = cable
        self.endpoint = f"tcp/{cable.here}:{free_port()}"

    def start_all(self, **settings):
        self.start_fusion("--set", f'zenoh.listen=["{self.endpoint}"]', "--set", "zenoh.insecure=true")
        for camera in CAMERAS:
            self.start(camera, self.cable.inside(*self.node_command(camera, zenoh__connect=f'["{self.endpoint}"]',
                                                                    zenoh__insecure="true", **settings)))
        self.wait_alive(*CAMERAS)


def cable_cut(work, ready, cut_s, observations):
    """The cable is cut after the observations were triggered and before the cameras fire."""
    lead_s = 3.0 + 1.5 * observations  # a busy machine takes a second for the command
    with Cable() as cable, CabledLine(work, ready, cable, deadline_s=min(10.0, cut_s + 5)) as line:
        line.start_all()
        sessions = sessions_of(observations)
        begin = time.monotonic()
        for index, session in enumerate(sessions):
            share = index / observations
            line.trigger_until_taken(session, in_s=max(0.1, lead_s + share * cut_s - (time.monotonic() - begin)))
        early_s = lead_s - 0.2 - (time.monotonic() - begin)
        assert early_s > 0, f"triggering took {-early_s:.1f} s too long to cut the cable before the cameras fire"
        time.sleep(early_s)
        with cable.cut():
            time.sleep(cut_s + 1)
            meanwhile = line.status()
            waiting = [o["waiting"] for o in meanwhile["session"]["observations"]]
            assert waiting == [list(CAMERAS)], meanwhile
            assert not line.complete_sessions()
        mended = time.monotonic()
        line.wait_for_results(sessions)
        took_s = time.monotonic() - mended
        line.wait_for(lambda status: all(camera["delivery"]["missing"] == 0 for camera in status["cameras"]), "no gap")
        account = line.account()
        assert account["results"] == observations and account["out of order"] == 0, account
        return {"cut_s": cut_s, "observations": observations, "all_there_after_s": round(took_s, 1), **account}


def packet_loss(work, ready, percent, observations):
    with Cable() as cable, CabledLine(work, ready, cable) as line:
        line.start_all()
        cable.lose(percent)
        sessions, times = sessions_of(observations), []
        for session in sessions:
            begin = time.monotonic()
            line.trigger_until_taken(session)
            line.wait_for_results([session])
            times.append(time.monotonic() - begin)
        account = line.account()
        assert account["results"] == observations, account
        return {"loss_percent": percent, "observations": observations, "median_s": round(statistics.median(times), 2),
                "slowest_s": round(max(times), 2), **account}


def arrivals_s(line):
    """Of every imprint the time from the node's having it to fusion's having stored it."""
    stored = {(camera, session, observation): 1e-9 * received_ns for camera, session, observation, received_ns in line.stored(
        "SELECT camera, session, observation, received_ns FROM message WHERE camera IS NOT NULL")}
    times = []
    for camera in CAMERAS:
        for time_text, session, observation in re.findall(r"^(\S+) info imprint-node: session (\S+) observation (\d+): imprint sent",
                                                          (line.folder / f"{camera}.log").read_text(errors="replace"), re.MULTILINE):
            sent = datetime.datetime.fromisoformat(time_text).astimezone().timestamp()
            times.append(stored[camera, session, int(observation)] - sent)
    return times


def thin_link(work, ready, minutes, live_s=20):
    """All three nodes behind 64 kbit/s: every minute 20 s of measuring, an operator peeking all the time."""
    with Cable() as cable, CabledLine(work, ready, cable, deadline_s=2 * PATIENCE_S) as line:
        line.start_all(capture__source='"folder"', capture__path=f'"{ready.folder.parent / "rendered"}"', exposure__auto="false",
                       health__period_s="5.0")
        line.trigger_until_taken("first")
        line.wait_for_results(["first"])
        cable.limit("64kbit")
        sessions, peeks, sizes, failures, done = ["first"], [], [], [], threading.Event()

        def peek_on():
            wanted = itertools.cycle((("cam1",), ("cam2", "--region", "100,100,400,300"), ("cam3", "--bytes", "2000")))
            for camera, *options in wanted:
                if done.is_set():
                    return
                peek = imprint("peek", camera, *options, "--connect", line.endpoint, "--out", line.folder / "peek.jpg", "--json")
                if peek.returncode:
                    failures.append(peek.stderr)
                    return
                about = json.loads(peek.stdout)
                peeks.append(about["took_s"])
                sizes.append(about["bytes"])
                done.wait(0.5)

        operator = threading.Thread(target=peek_on)
        operator.start()
        try:
            for minute in range(minutes):
                begin = time.monotonic()
                while time.monotonic() - begin < live_s:
                    sessions.append(f"M{minute}-{len(sessions)}")
                    line.trigger_until_taken(sessions[-1])
                    time.sleep(4)
                if minute + 1 < minutes:
                    time.sleep(max(0, 60 - (time.monotonic() - begin)))
        finally:
            done.set()
            operator.join()
        assert not failures, failures
        line.wait_for_results(sessions)
        took = arrivals_s(line)
        assert len(took) == len(CAMERAS) * len(sessions)
        figures = {"imprints": len(took), "imprint_median_s": round(statistics.median(took), 2), "imprint_slowest_s": round(max(took), 2),
                   "peeks": len(peeks), "peek_median_s": round(statistics.median(peeks), 2), "peek_slowest_s": round(max(peeks), 2),
                   "peek_bytes": f"{min(sizes)}-{max(sizes)}"}
        assert max(took) < 3 and max(peeks) < 5, figures
        return figures


@contextlib.contextmanager
def small_disk(folder, size_kb):
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size_kb}k", "tmpfs", folder], check=True)
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)


@contextlib.contextmanager
def filled(folder):
    filler = folder / "filler"
    with contextlib.suppress(OSError), open(filler, "wb", buffering=0) as file:
        while file.write(b"x" * 512):
            pass
    try:
        yield
    finally:
        filler.unlink()


def alarms(status):
    return {alarm["name"] for alarm in status["alarms"]}


def node_disk_full(work, ready):
    with ReadyLine(work, ready) as line, small_disk(line.folder / "imprint-data", 256):
        line.start_all()
        # A disk of 256 kB also stays below `alarm.min_storage_mb`: that alarm is right throughout.
        spools = {f"spool_{camera}" for camera in CAMERAS}
        with filled(line.folder / "imprint-data"):
            line.trigger_until_taken("S0")
            line.wait_for_results(["S0"])  # measuring goes on
            line.wait_for(lambda status: spools <= alarms(status), "an alarm of every node")
        line.trigger_until_taken("S1")
        line.wait_for_results(["S1"])
        line.wait_for(lambda status: not spools & alarms(status), "no alarm of a spool any more")
        line.kill_all()
        return line.account()


def fusion_disk_full(work, ready):
    with ReadyLine(work, ready) as line, small_disk(line.folder / "disk", 16384):
        line.start_fusion("--set", f'fusion.database="{line.folder / "disk" / "imprint.db"}"')
        (line.folder / "imprint.db").symlink_to(line.folder / "disk" / "imprint.db")
        line.start_nodes(*CAMERAS)
        line.wait_alive(*CAMERAS)
        line.trigger_until_taken("S0")
        line.wait_for_results(["S0"])
        line.trigger_until_taken("S1", in_s=4)
        with filled(line.folder / "disk"):
            line.wait_for(lambda status: "store" in alarms(status), "an alarm of the store")
            assert line.complete_sessions() == {"S0"}
            time.sleep(2)
        line.wait_for_results(["S1"])  # nobody restarts anything
        line.wait_for(lambda status: not alarms(status), "no alarm any more")
        return line.account()


def clock_jumps(work, ready, jump_s=3600):
    """A node whose clock is an hour ahead, then right; then fusion's an hour ahead, then right."""
    with ReadyLine(work, ready) as line:
        def shift(name, seconds):
            (line.folder / f"{name}.shift").write_text(f"{seconds}\n", encoding="utf-8")

        def shifted(name):
            shift(name, 0)
            # A program with sanitizers wants to be first; this one is not in their way.
            return {"LD_PRELOAD": os.environ["IMPRINT_CLOCK_SHIFT"], "CLOCK_SHIFT_FILE": str(line.folder / f"{name}.shift"),
                    "ASAN_OPTIONS": "verify_asan_link_order=0"}

        def measured(camera, seconds):
            index = CAMERAS.index(camera)
            return line.wait_for(lambda status: (clock := status["cameras"][index]["clock"]) and
                                 abs(clock["offset_s"] - seconds) < 1, f"{camera}'s clock {seconds} s off")

        def take(session, in_s=0):
            line.trigger_until_taken(session, in_s=in_s)
            line.wait_for_results([session])
            (text,), = line.stored(f"SELECT json_extract(json, '$.warnings') FROM result WHERE session = '{session}'")
            return text

        line.start_fusion(**shifted("fusion"))
        line.start_nodes("cam1", "cam3")
        environment = shifted("cam2")
        shift("cam2", jump_s)
        line.start("cam2", line.node_command("cam2"), environment)
        line.wait_alive(*CAMERAS)
        status = measured("cam2", jump_s)
        clock = status["cameras"][1]["clock"]
        assert "clock_cam2" in alarms(status), status["alarms"]
        warnings = take("ahead", in_s=2)
        assert f"the clock of cam2 was {jump_s}.0 s ahead" in warnings, warnings
        assert "took its frame" not in warnings, warnings  # it fired with the others, by fusion's clock
        shift("cam2", 0)
        take("jumped-back")
        measured("cam2", 0)
        warnings = take("right", in_s=2)
        assert warnings == "[]", warnings
        shift("fusion", jump_s)
        take("fusion-ahead")
        measured("cam1", -jump_s)
        shift("fusion", 0)
        take("fusion-right")
        account = line.account()
        assert (account["results"], account["results made anew"]) == (5, 0), account
        return {"jump_s": jump_s, "measured_s": round(clock["offset_s"], 4),
                "uncertainty_s": round(clock["uncertainty_s"], 4), **account}


def memory_mb(process, field):
    """VmRSS now, VmHWM at most so far."""
    fields = dict(line.split(":", 1) for line in pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines())
    return int(fields[field].split()[0]) / 1024


def day(work, ready, observations, pace_s, most_growth_mb=4.0):
    """Observations one after the other at 100 times a plant's pace, health at 50 times its own: no process may grow
    from the second quarter of the day to the last."""
    with ReadyLine(work, ready) as line:
        line.start_fusion()
        line.start_nodes(*CAMERAS, health__period_s="0.1")
        line.wait_alive(*CAMERAS)
        used = {name: [] for name in ("fusion", *CAMERAS)}
        begin = time.monotonic()
        for index, session in enumerate(sessions := sessions_of(observations)):
            line.trigger_until_taken(session)
            for name, samples in used.items():
                samples.append(memory_mb(line.processes[name], "VmRSS"))
            time.sleep(max(0.0, begin + (index + 1) * pace_s - time.monotonic()))
        line.wait_for_results(sessions)
        taken_s = time.monotonic() - begin
        quarter = observations // 4
        grown = {name: statistics.median(samples[-quarter:]) - statistics.median(samples[quarter:2 * quarter])
                 for name, samples in used.items()}
        assert max(grown.values()) <= most_growth_mb, grown
        return {"observations": observations, "seconds": round(taken_s),
                **{f"{name}_mb": f"{samples[-1]:.1f} ({grown[name]:+.1f})" for name, samples in used.items()}, **line.account()}


def hostile_client(work, ready, python, messages):
    """A client that floods, sends 10 MB messages, what is no protobuf, old and new schema versions."""
    with ReadyLine(work, ready) as line:
        line.start_all()
        line.trigger_until_taken("before")
        line.wait_for_results(["before"])
        quiet_mb = memory_mb(line.processes["fusion"], "VmHWM")
        client = subprocess.run([python, HERE / "hostile_client.py", line.endpoint, str(messages),
                                 ready.folder / "obs00_cam1.imprint"], capture_output=True, text=True, timeout=4 * PATIENCE_S, check=False)
        assert client.returncode == 0, client.stderr
        line.trigger_until_taken("after")
        line.wait_for_results(["after"])
        counters = line.status()["counters"]
        grown_mb = memory_mb(line.processes["fusion"], "VmHWM") - quiet_mb
        assert counters["malformed"] > 0, counters
        assert line.complete_sessions() >= {"before", "after"}
        return {"messages": messages, "fusion_grew_mb": round(grown_mb), "malformed": counters["malformed"],
                "dropped": counters["dropped"], **line.account()}
