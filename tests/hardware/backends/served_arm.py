"""An emulated bench whose arm another program commands: `python served_arm.py FOLDER WORDS`; nose and valve at ptys, the arm at a socket.

A line of JSON asks: "read" for {q, load}, or numbers, to which the joints are led. It ends with its standard input.
"""

import json
import socketserver
import sys
import threading
from pathlib import Path

from hydra.utils import instantiate

from hardware import emulate
from hardware.emulators import options
from hardware.emulators.emulated_bench import emulate_bench


def serve(realtime, path):
    class Handler(socketserver.StreamRequestHandler):
        def handle(self):
            for line in self.rfile:
                asked = json.loads(line)
                if asked != "read":
                    for joint, goal in enumerate(asked):
                        realtime.steer(joint, goal)
                answer = {"q": realtime.angles().tolist(), "load": realtime.loads().tolist()}
                self.wfile.write(f"{json.dumps(answer)}\n".encode())

    server = socketserver.ThreadingUnixStreamServer(str(path), Handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()


def main(folder, words):
    own = [word for word in words if word.partition("=")[0] in ("nose", "valve", "speed")]
    bench_words = [emulate.DRIFTLESS, *(word for word in words if word not in own)]
    chosen, _ = options.read([*own, "arm=none", f"out={folder / 'ports'}"], emulate.KEYS)
    cfg = emulate._composed(bench_words)
    with emulate_bench(chosen, instantiate(cfg.backend)) as bench:
        serve(bench.loop.realtime, folder / "arm")
        print(emulate._connect_command(chosen, cfg, bench_words, bench), flush=True)
        bench.loop.run(emulate._at_eof)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
