"""The lab under load and its times: `python -m tests.benchmarks.lab`. It needs chromium, for the times, and some minutes.

Printed are the processor time of a frame and of a slider's change in the server, with N = 64; the memory and the open files of the
server before and after 100 reconnects, 10 pages at once, and a slider that is dragged for a minute; and, of a page in chromium, the
time to its first picture, its frames per second, and the time from a slider's event to the picture of it.
"""

import asyncio
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from tornado.httpclient import HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect

from compare.lab.engine import Engines
from compare.lab.session import Session
from compare.lab.settings import Settings

SECONDS = 60.0  # of dragging
FIRST = """const done = arguments[0];
const look = () => globalThis.discs?.stats.frames > 0 ? done(performance.now()) : setTimeout(look, 5);
look()"""


def costs() -> None:
    """Processor time of messages, in this process."""
    engines = Engines()
    lab = Session(Settings(n=64), engines=engines)
    for _ in range(600):  # until the kernels are there
        lab.handle({"kind": "advance", "time": 0.0167})
        lab.handle({"kind": "set", "name": "damping", "value": 0.1})
        if lab._engine == "compiled":
            break
        time.sleep(0.1)
    for name, make in (
        ("frame, 1/60 of a unit of time", lambda i: {"kind": "advance", "time": 0.0167}),
        ("slider that goes on", lambda i: {"kind": "set", "name": "bending_stiffness", "value": 0.5 + 0.001 * (i % 500)}),
        ("slider that starts again", lambda i: {"kind": "set", "name": "twist", "value": 0.5 + 0.001 * (i % 500)}),
    ):
        taken = []
        for i in range(200):
            start = time.process_time()
            lab.handle(make(i))
            taken.append(1e3 * (time.process_time() - start))
        print(f"{name}: {statistics.median(taken):.2f} ms of a processor, engine {lab._engine}", flush=True)
    engines.close()


def resources(pid: int) -> str:
    """Memory and open files of a process."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return f"{pages * os.sysconf('SC_PAGE_SIZE') / 1e6:.0f} MB, {len(os.listdir(f'/proc/{pid}/fd'))} open files"


async def opened(address: str) -> WebSocketClientConnection:
    """A page's socket, after its first frame."""
    origin = "/".join(address.split("/")[:3])
    request = HTTPRequest(f"{address.replace('http', 'ws')}socket", headers={"Origin": origin})
    socket = await websocket_connect(request)
    await socket.read_message()
    await socket.read_message()
    return socket


async def told(socket: WebSocketClientConnection, **message: Any) -> float:
    """Send a message and wait for its reply; the seconds that it took."""
    start = time.perf_counter()
    await socket.write_message(json.dumps(message))
    await socket.read_message()
    return time.perf_counter() - start


async def load(address: str, pid: int) -> None:
    """Reconnects, pages at once, and a slider that is dragged."""
    socket = await opened(address)
    for i in range(50):
        await told(socket, kind="set", name="bending_stiffness", value=0.5 + 0.01 * i)
        await told(socket, kind="advance", time=0.0167)
    print(f"at first: {resources(pid)}", flush=True)
    for _ in range(100):
        (await opened(address)).close()
    await asyncio.sleep(1.0)
    print(f"after 100 reconnects: {resources(pid)}", flush=True)
    many = [await opened(address) for _ in range(10)]
    for _ in range(100):
        await asyncio.gather(*(told(each, kind="advance", time=0.0167) for each in many))
    print(f"with 10 pages: {resources(pid)}", flush=True)
    for each in many:
        each.close()
    await asyncio.sleep(1.0)
    taken, end = [], time.monotonic() + SECONDS
    while time.monotonic() < end:
        taken.append(await told(socket, kind="set", name="radius", value=1.0 + 0.5 * ((len(taken) * 0.01) % 1.0)))
        await told(socket, kind="advance", time=0.0167)
    late = sorted(taken)
    print(
        f"slider dragged for {SECONDS:g} s, {len(taken)} changes: reply after {1e3 * late[len(late) // 2]:.1f} ms (median), "
        f"{1e3 * late[int(0.99 * len(late))]:.1f} ms (99 of 100); then {resources(pid)}",
        flush=True,
    )
    socket.close()


def in_browser(address: str) -> None:
    """Times of a page in chromium."""
    from selenium import webdriver

    from tests.discs.conftest import FLAGS

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for flag in FLAGS.replace("--force-prefers-reduced-motion", "").replace("700,600", "1280,800").split():
        options.add_argument(flag)
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=shutil.which("chromedriver")))
    try:
        browser.set_script_timeout(120)
        for _ in range(3):
            browser.get(address)
            first = browser.execute_async_script(FIRST)
            print(f"first picture after {first / 1e3:.2f} s", flush=True)
        time.sleep(4)
        counts = []
        for _ in range(5):
            start, began = browser.execute_script("return [discs.stats.frames, performance.now()]")
            time.sleep(1)
            end, ended = browser.execute_script("return [discs.stats.frames, performance.now()]")
            counts.append(1e3 * (end - start) / (ended - began))
        about = browser.execute_script("return [discs.stage.renderer.getPixelRatio(), discs.frame.engine, discs.stage.count]")
        print(f"frames per second: {', '.join(f'{each:.0f}' for each in counts)} (pixels, engine, panels: {about})", flush=True)
        slider = browser.find_element("xpath", "//label[starts-with(., 'bending stiffness')]//input")
        for _ in range(40):
            slider.send_keys("\ue014")  # right arrow
        time.sleep(1)
        taken = sorted(browser.execute_script("return discs.stats.slider"))
        print(f"slider to picture: {taken[len(taken) // 2]:.0f} ms (median of {len(taken)}), {taken[0]:.0f} ms at best", flush=True)
    finally:
        browser.quit()


def main() -> None:
    """Measure everything."""
    costs()
    command = [sys.executable, "-m", "compare", "lab", "--no-browser", "--stay", "--n", "64"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None
        try:
            asyncio.run(load(found[0], process.pid))
            if shutil.which("chromium"):
                in_browser(found[0])
        finally:
            process.terminate()  # not Ctrl-C, which background jobs ignore
            process.wait()


if __name__ == "__main__":
    main()
