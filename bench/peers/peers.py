# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""Time and score the peers on one data file, each in a process of its own.

    ./setup_peers.sh ENVS                       # once
    python peers.py DATA.npz --envs ENVS --out results.json [--quick]

Without --envs every peer runs in the interpreter that runs this file, and what it
lacks is reported as missing. A peer that cannot run gives {peer, error}.
This driver needs the standard library only.
"""

import argparse
import importlib
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
import traceback
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).resolve().parent


class Peer(NamedTuple):
    environment: str
    module: str
    arguments: tuple  # of the module's run(), after the data
    threads: int  # for BLAS; small SVDs on several threads crawl when the machine is shared
    slow: bool  # takes more than 20 s
    distributions: tuple  # whose versions are reported


PEERS = {
    "numpy": Peer("numpy2", "peer_numpy", (), 1, False, ("numpy",)),
    "numpy-2-threads": Peer("numpy2", "peer_numpy", (), 2, False, ("numpy",)),
    "pinocchio": Peer("numpy2", "peer_pinocchio", (), 1, False, ("pin", "numpy")),
    "blas": Peer("numpy2", "peer_blas", (), 2, False, ("scipy", "numpy")),
    "robotkinecal": Peer(
        "numpy1", "peer_robotkinecal", (), 1, False, ("robotkinecal", "roboticstoolbox-python", "numpy")
    ),
    "figaroh": Peer(
        "numpy2", "peer_figaroh", ("structural",), 1, False, ("figaroh", "pin", "scipy", "numpy")
    ),
    "figaroh-excitation": Peer(
        "numpy2", "peer_figaroh", ("excitation",), 1, True, ("figaroh", "pin", "scipy", "numpy")
    ),
    "pybotics-trf": Peer("numpy1", "peer_pybotics", ("trf",), 1, True, ("pybotics", "scipy", "numpy")),
    "pybotics-lm": Peer("numpy1", "peer_pybotics", ("lm",), 1, True, ("pybotics", "scipy", "numpy")),
}


def versions(distributions):
    found = {"python": platform.python_version()}
    for name in distributions:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = None
    return found


def work(name, data_file, out):
    """Run one peer here and write its results (called by the driver in a new process)."""
    peer = PEERS[name]
    try:
        import numpy as np

        data = {key: value for key, value in np.load(data_file).items() if not key.startswith("true_")}
        results = importlib.import_module(peer.module).run(data, *peer.arguments)
    except Exception as error:
        traceback.print_exc()
        results = [{"error": f"{type(error).__name__}: {error}"}]
    found = versions(peer.distributions)
    results = [{"peer": name, **result, "versions": found} for result in results]
    Path(out).write_text(json.dumps(results))


def drive(name, data_file, envs, timeout):
    """Results of one peer, from a process with its own environment and number of threads."""
    peer = PEERS[name]
    # absolute, not resolved: an environment's python is a link, and the worker runs in another folder
    python = Path(envs).absolute() / peer.environment / "bin" / "python" if envs else Path(sys.executable)
    command = f"python peers.py {Path(data_file).name} --only {name}"
    if not python.exists():
        return [{"peer": name, "error": f"environment '{peer.environment}' was not made", "command": command}]
    variables = dict(os.environ)
    for key in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        variables[key] = str(peer.threads)
    with tempfile.TemporaryDirectory() as folder:
        out, log = Path(folder) / "out.json", Path(folder) / "log.txt"
        with log.open("w") as file:
            try:
                subprocess.run(
                    [str(python), __file__, str(data_file), "--worker", name, "--out", str(out)],
                    stdout=file,
                    stderr=subprocess.STDOUT,
                    env=variables,
                    cwd=HERE,
                    timeout=timeout,
                )
            except subprocess.TimeoutExpired:
                return [{"peer": name, "error": f"stopped after {timeout:g} s", "command": command}]
        if not out.exists():
            tail = log.read_text().strip().splitlines()[-1:]
            return [{"peer": name, "error": f"ended without a result: {' '.join(tail)}", "command": command}]
        results = json.loads(out.read_text())
    return [{**result, "command": command, "threads": peer.threads} for result in results]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--envs", type=Path, help="directory given to setup_peers.sh")
    parser.add_argument("--quick", action="store_true", help="leave out what takes more than 20 s")
    parser.add_argument("--only", help="comma-separated names: " + ", ".join(PEERS))
    parser.add_argument("--timeout", type=float, default=600, help="limit for one peer [s]")
    parser.add_argument("--worker", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.worker:
        work(args.worker, args.data, args.out)
        return
    names = args.only.split(",") if args.only else list(PEERS)
    unknown = sorted(set(names) - set(PEERS))
    if unknown:
        parser.error(f"no peer named {', '.join(unknown)}; there are {', '.join(PEERS)}")
    args.data.stat()  # a missing file is the caller's mistake, not a peer's
    load = os.getloadavg()[0]
    results = []
    for name in names:
        if args.quick and PEERS[name].slow:
            results.append({"peer": name, "skipped": "takes more than 20 s (--quick)"})
            continue
        began = time.perf_counter()
        new = drive(name, args.data.resolve(), args.envs, args.timeout)
        results += new
        for result in new:
            if "error" in result:
                print(f"{name:20} {result['error']}")
                continue
            line = f"{name:20} {result['task']:20} {result['seconds'] * 1e3:12.2f} ms"
            if "test_mean_m" in result:
                line += (
                    f"   test mean {result['test_mean_m'] * 1e6:6.1f} um, noisy"
                    f" {result['test_noisy_mean_m'] * 1e6:6.1f} um"
                )
            if "gflops" in result:
                line += f"   {result['gflops']:.1f} GFLOP/s"
            print(line)
        print(f"{'':20} (whole process {time.perf_counter() - began:.1f} s)", flush=True)
    document = {
        "machine": {"processor": processor(), "cores": os.cpu_count(), "system": platform.system()},
        # above the number of cores, something else ran too: trust no time of this file
        "load_average": {"before": load, "after": os.getloadavg()[0]},
        "data": args.data.name,
        "results": results,
    }
    args.out.write_text(json.dumps(document, indent=1) + "\n")


def processor():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()


if __name__ == "__main__":
    main()
