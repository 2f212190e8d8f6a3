"""COLMAP in a process that wants to be told to stop."""

import subprocess
import sys

_ASKED = """
import os, signal, threading, time
signal.signal(signal.SIGTERM, lambda *_: print("put away", flush=True))
loading = threading.Thread(target=__import__, args=["ingest.colmap"])
loading.start()
loading.join()
os.kill(os.getpid(), signal.SIGTERM)
time.sleep(0.1)
print("ended", flush=True)
"""


def test_sigterm_stays_with_the_process_when_colmap_is_loaded():
    done = subprocess.run([sys.executable, "-c", _ASKED], capture_output=True, text=True)
    assert (done.returncode, done.stdout.split("\n")[:2]) == (0, ["put away", "ended"])
    assert done.stderr == ""
