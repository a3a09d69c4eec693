"""The lab's server, without a browser: what it serves, what it refuses, how it ends."""

import asyncio
import json
import re
import signal
import struct
import subprocess
import sys

import numpy as np
import pytest

from compare.lab.settings import Settings

tornado = pytest.importorskip("tornado", reason="needs tornado, of the extra lab")
server = pytest.importorskip("compare.lab.server")
client = pytest.importorskip("tornado.httpclient")
websocket = pytest.importorskip("tornado.websocket")


def served(what, **settings):
    """The result of a coroutine with a lab that is served."""

    async def run():
        lab = server.Lab(Settings(n=9, **settings))
        lab.fields, lab.engines = None, None
        http = lab.listen()
        try:
            return await what(lab)
        finally:
            http.stop()
            await http.close_all_connections()

    return asyncio.run(run())


async def fetched(address, **headers):
    request = client.HTTPRequest(address, headers=headers)
    asking = client.AsyncHTTPClient(force_instance=True)
    try:
        return await asking.fetch(request, raise_error=False)
    finally:
        asking.close()


async def opened(lab, origin=None, address=None, **headers):
    address = address or f"{lab.address.replace('http', 'ws')}socket"
    given = {"Origin": origin or lab.address.split("/", 3)[0] + f"//{server.HOST}:{lab.port}"} | headers
    return await websocket.websocket_connect(client.HTTPRequest(address, headers=given))


async def shut(socket):
    """Close a socket, and wait until it is: a loop that ends before leaves it open."""
    socket.close()
    while await asyncio.wait_for(socket.read_message(), 20) is not None:
        pass


async def read(socket):
    """The next reply: its object and its numbers."""
    data = await asyncio.wait_for(socket.read_message(), 20)
    if data is None:
        return None
    (length,) = struct.unpack_from("<I", data)
    return json.loads(data[4 : 4 + length]), np.frombuffer(data, "<f4", offset=4 + length)


def test_serves_a_page_that_takes_nothing_from_outside():
    async def look(lab):
        found = {}
        for name in ("", "lab.js", "lab.css", "socket.js"):
            response = await fetched(lab.address + name)
            assert response.code == 200, name
            found[name] = response.body.decode(), response.headers
        return found

    parts = served(look)
    assert not re.findall("https?://", parts[""][0] + parts["lab.css"][0] + parts["socket.js"][0])
    assert parts["lab.js"][0].endswith("export default { render };\n")
    policy = parts[""][1]["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; script-src 'self'; ")
    assert "unsafe" not in policy
    assert "Server" not in parts[""][1]


@pytest.mark.parametrize(
    "path", ["/", "/wrong/", "/wrong/lab.js", "/favicon.ico", "/../../etc/passwd", "/{token}/../server.py", "/{token}/lab.css.bak"]
)
def test_other_addresses_are_refused(path):
    async def look(lab):
        return await fetched(f"http://{server.HOST}:{lab.port}{path.format(token=lab.token)}")

    response = served(look)
    assert response.code in (403, 404)
    assert b"Traceback" not in response.body


def test_other_hosts_are_refused():
    """A name of a foreign page that leads to 127.0.0.1."""

    async def look(lab):
        return await fetched(lab.address, Host=f"evil.example:{lab.port}")

    assert served(look).code == 403


@pytest.mark.parametrize("case", ["origin", "no origin", "token", "host"])
def test_sockets_of_others_are_refused(case):
    async def look(lab):
        wrong = f"ws://{server.HOST}:{lab.port}/wrong/socket" if case == "token" else None
        origin = "http://evil.example" if case == "origin" else "null" if case == "no origin" else None
        headers = {"Host": f"evil.example:{lab.port}"} if case == "host" else {}
        with pytest.raises(client.HTTPClientError) as refused:
            await opened(lab, origin, wrong, **headers)
        assert not lab.pages
        return refused.value.code

    assert served(look) == 403


def test_answers_messages():
    async def play(lab):
        socket = await opened(lab)
        scene, _ = await read(socket)
        first, numbers = await read(socket)
        assert (scene["kind"], first["kind"], first["t"]) == ("scene", "frame", 0.0)
        assert numbers.size == first["n"] * len(first["rows"])
        await socket.write_message(json.dumps({"kind": "advance", "time": 0.02}))
        second, _ = await read(socket)
        assert second["t"] == pytest.approx(0.02)
        await socket.write_message(json.dumps({"kind": "eval", "code": "1"}))
        refused, _ = await read(socket)
        assert refused["kind"] == "refused"
        assert "kind must be one of" in refused["text"]
        await socket.write_message(json.dumps({"kind": "step", "by": "forward"}))
        assert [(await read(socket))[0]["kind"] for _ in range(3)] == ["scene", "frame", "frame"]
        await shut(socket)

    served(play)


@pytest.mark.parametrize(("message", "binary"), [("{", False), (b"\0\1", True), ("x" * 5000, False), ("y" * 100_000, False)])
def test_what_is_no_message_closes_the_socket(message, binary):
    async def play(lab):
        socket = await opened(lab)
        await read(socket), await read(socket)
        await socket.write_message(message, binary=binary)
        assert await read(socket) is None
        socket.close()
        return socket.close_code

    assert served(play) in (1007, 1009)


def test_reconnects_and_pages_at_once_leave_nothing(monkeypatch):
    """30 pages one after the other, one more than are allowed at once; then no session is left."""
    monkeypatch.setattr(server, "MOST_PAGES", 3)

    async def play(lab):
        lab.stays = True
        for _ in range(30):
            socket = await opened(lab)
            await read(socket)
            await shut(socket)
        sockets = [await opened(lab) for _ in range(4)]
        kinds = [(await read(socket))[0]["kind"] for socket in sockets]
        for socket in sockets:
            await shut(socket)
        for _ in range(100):
            if not lab.pages:
                break
            await asyncio.sleep(0.02)
        return kinds, len(lab.pages)

    kinds, left = served(play)
    assert kinds.count("scene") <= 3
    assert kinds[-1] == "ended"
    assert left == 0


def test_ends_with_its_last_page(monkeypatch):
    monkeypatch.setattr(server, "LEAVES", 0.05)

    async def play(lab):
        one, other = await opened(lab), await opened(lab)
        await shut(one)
        await asyncio.sleep(0.3)
        assert not lab.ended.is_set()
        await shut(other)
        await asyncio.wait_for(lab.ended.wait(), 10)

    served(play)


@pytest.mark.slow
def test_the_command_ends_by_ctrl_c():
    command = [sys.executable, "-m", "compare", "lab", "--no-browser", "--n", "9"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        address = re.search(r"http://127\.0\.0\.1:\d+/[\w-]{22}/", process.stdout.readline())
        assert address
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 0
    assert errors.strip() == "the lab has ended"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--n", "1"], "error: --n must be a whole number from 2 to 1025; got 1"),
        (["--n", "2"], "error: n (discs, ends='springs') must be a whole number of at least 3"),
        (["--port", "70000"], "error: --port must be from 0 to 65535; got 70000"),
        (["--scene", "no.toml"], "error: no.toml cannot be read"),
    ],
)
def test_bad_options(options, message, capsys):
    from compare.__main__ import main

    assert main(["lab", "--no-browser", *options]) == 2
    assert message in capsys.readouterr().err
