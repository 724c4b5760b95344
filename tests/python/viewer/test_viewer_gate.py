"""Who may see the page of the viewer, what it hears, and how it ends."""

import http.client
import json
import logging
import math
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from urllib.parse import parse_qs, urlsplit

import amontons
import pytest
from amontons import Simulation, scenes
from waiting import LONGEST, until

viser = pytest.importorskip("viser", reason="needs viser: pip install 'amontons[view]'")
msgspec = pytest.importorskip("msgspec")
connect = pytest.importorskip("websockets.sync.client").connect
closed = pytest.importorskip("websockets.exceptions")


@pytest.fixture
def viewer():
    sim = Simulation(scenes.make("stack", boxes=3), dt=5e-3, on_failure="ignore")
    with amontons.view(sim, allow_origin=["https://watch.example:8443"]) as shown:
        yield shown


def port(viewer):
    return urlsplit(viewer.url).port


def token(viewer):
    return parse_qs(urlsplit(viewer.url).query)["token"][0]


def status(viewer, path, **headers):
    """Of a request with exactly these headers."""
    connection = http.client.HTTPConnection("127.0.0.1", port(viewer), timeout=LONGEST)
    connection.putrequest("GET", path, skip_host=True)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    return connection.getresponse().status


CAMERA = msgspec.msgpack.encode(
    {
        "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [0, -3, 1], "fov": 1, "near": 0.01,
        "far": 1000, "image_height": 600, "image_width": 800, "look_at": [0, 0, 0], "up_direction": [0, 0, 1],
    }
)  # fmt: skip


@contextmanager
def page(viewer, address=None, **options):
    """A socket as the page opens one."""
    address = address or f"ws://localhost:{port(viewer)}/{token(viewer)}"
    protocol = [f"viser-v{viser.__version__}"]
    with connect(address, subprotocols=protocol, max_size=None, proxy=None, **options) as opened:
        opened.recv(timeout=LONGEST)
        opened.send(CAMERA)
        yield opened


def control(viewer, label):
    """The identity of a control of the page, which the server sends to every page."""
    inputs = viewer._server.gui._gui_input_handle_from_uuid
    return next(uuid for uuid, handle in inputs.items() if getattr(handle, "label", "") == label)


def change(viewer, label, value):
    told = {"type": "GuiUpdateMessage", "uuid": control(viewer, label), "updates": {"value": value}}
    return msgspec.msgpack.encode(told)


# Breaks when a request is answered that has no token, a wrong one, asks for a name that is not the viewer's
# (one that an attacker lets resolve to this machine), or comes from a page of another origin.
def test_pages_need_token_host_and_origin(viewer):
    own, secret = f"localhost:{port(viewer)}", token(viewer)
    assert len(secret) >= 20
    for path in (f"/{secret}/", f"/{secret}/index.html"):
        assert status(viewer, path, Host=own) == 200
        assert status(viewer, path, Host=f"127.0.0.1:{port(viewer)}") == 200
        assert status(viewer, path, Host=own, Origin=f"http://{own}") == 200
        assert status(viewer, path, Host="watch.example:8443", Origin="https://watch.example:8443") == 200
        for host in ("evil.example", f"evil.example:{port(viewer)}", "localhost", "localhost:1", ""):
            assert status(viewer, path, Host=host) == 403
        for origin in ("http://evil.example", "null", "http://localhost:1", f"https://{own}", ""):
            assert status(viewer, path, Host=own, Origin=origin) == 403
        assert status(viewer, path) in (400, 403)
    assert status(viewer, f"/?token={secret}", Host=own) == 302
    for path in ("/", "/index.html", "/?token=", f"/?token={secret}x", f"/{secret}x/", f"/x/{secret}/", "//"):
        assert status(viewer, path, Host=own) == 403


# Breaks when the socket, by which the scene is read and options are set, asks for less than the page.
def test_sockets_need_token_host_and_origin(viewer):
    own, secret = f"localhost:{port(viewer)}", token(viewer)
    with page(viewer, origin=f"http://{own}"), page(viewer, origin="https://watch.example:8443"):
        pass
    refused = [
        (f"ws://{own}", f"http://{own}"),
        (f"ws://{own}/{secret[:-1]}", f"http://{own}"),
        (f"ws://{own}/{secret}", "http://evil.example"),
        (f"ws://{own}/{secret}", f"http://evil.example:{port(viewer)}"),
        (f"ws://{own}/{secret}", "null"),
    ]
    for address, origin in refused:
        with pytest.raises(closed.InvalidStatus, match="403"), page(viewer, address, origin=origin):
            pass


# Breaks when a further origin that is none is accepted, among them one for all.
@pytest.mark.parametrize(
    "origin", ["*", "http://*", "example.com", "ftp://a:1", "http://a:x", "", 3, "http://u@a"]
)
def test_origins_are_checked(origin):
    with pytest.raises(amontons.InputError, match="is no origin; write http://NAME:PORT"):
        amontons.view(Simulation(scenes.make("stack", boxes=1)), allow_origin=[origin])


# Breaks when the speed of a user, or of a page, may be what no clock can follow.
@pytest.mark.parametrize("speed", [math.inf, math.nan, -1.0, 0.0, "fast"])
def test_speed_is_checked(viewer, speed):
    with pytest.raises(amontons.InputError, match="speed"):
        amontons.view(Simulation(scenes.make("stack", boxes=1)), speed=speed)
    with page(viewer) as opened:
        opened.send(change(viewer, "Speed", str(speed)))
        opened.send(change(viewer, "Speed", speed))
        opened.send(change(viewer, "Speed", "0.25"))
        assert until(lambda: viewer.run.speed == 0.25)


# Breaks when a value of a page goes past the checks of what users hand in: a type of another kind, a number
# beyond its slider, a choice that there is not, another property than the value.
def test_values_are_checked(viewer, caplog):
    sim = viewer.run.simulation
    values = {
        "Law": ("none",), "Method": ("x", 1), "Tolerance": ("inf", 5), "Arrow length x1": (1e6, "1"),
        "Step (ms)": (-1, math.nan, 1e300, "1", True, None), "Forces": ("yes", None, 2),
    }  # fmt: skip
    wrong = [
        *(change(viewer, label, value) for label, tried in values.items() for value in tried),
        msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": control(viewer, "Law"),
                                "updates": {"options": ["x"], "value": "x"}}),
        msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": "none", "updates": {"value": 1}}),
    ]  # fmt: skip
    options, scale = dict(sim.options), viewer.marks.force_scale
    with caplog.at_level(logging.WARNING), page(viewer) as opened:
        for message in wrong:
            opened.send(message)
        opened.send(change(viewer, "Law", "associated"))
        assert until(lambda: sim.options["law"] == "associated")
        assert until(lambda: len(caplog.records) >= len(wrong))
    assert dict(sim.options) == {**options, "law": "associated"}
    assert viewer.marks.force_scale == scale
    assert not viewer.marks.wanted["forces"]
    assert len(caplog.records) == len(wrong)


def drag(**changes):
    told = {
        "type": "SceneNodeDragMessage", "phase": "start", "name": "/scene/visual 0", "instance_index": 0,
        "start_position": [0.0, 0.0, 1.0], "start_screen_pos": [0.5, 0.5], "end_position": [0.0, 0.0, 1.0],
        "end_screen_pos": [0.5, 0.5], "button": "left", "modifier": None, "owner": "",
    }  # fmt: skip
    return msgspec.msgpack.encode(told | changes)


# Breaks when a malformed message takes more than a line of the log, ends the connection, or goes unheard of;
# and when a page can ask for what the viewer has no use for: viser's tunnel to a server elsewhere.
def test_a_malformed_message_is_a_line(viewer, caplog):
    wrong = [
        b"", b"\x81", b"\xff" * 50, b"\x91" * 100_000, "text", msgspec.msgpack.encode(7),
        msgspec.msgpack.encode({}), msgspec.msgpack.encode({"type": ["x"]}),
        msgspec.msgpack.encode({"type": "NoSuchMessage\x1b[2J\n"}),
        msgspec.msgpack.encode({"type": "ShareUrlRequest"}),
        msgspec.msgpack.encode({"type": "FileTransferStartUpload"}),
        msgspec.msgpack.encode({"type": "ViewerCameraMessage", "wxyz": [math.nan, 0, 0, 0]}),
        msgspec.msgpack.encode({"type": "GuiUpdateMessage"}),
        drag(instance_index=-1), drag(instance_index="0"), drag(phase="none"), drag(unknown=1),
        drag(name={}), drag(owner=[]), drag(modifier={}),
        drag(end_position=[math.inf, 0, 0]), drag(end_position=[1.0]), drag(start_position=None),
    ]  # fmt: skip
    with caplog.at_level(logging.WARNING), page(viewer) as opened:
        for message in wrong:
            opened.send(message)
        opened.send(drag(instance_index=10**6))  # of a body that there is not: nothing is grabbed
        opened.send(change(viewer, "Law", "associated"))
        assert until(lambda: viewer.run.simulation.options["law"] == "associated")
    assert viewer.run.spring.body is None
    lines = [record.getMessage() for record in caplog.records]
    assert len(lines) == len(wrong), lines
    assert all(line.isprintable() and len(line) < 500 for line in lines)
    assert not any(record.exc_info for record in caplog.records)


# Breaks when wishes of pages fill the memory, or keep the owner from showing pictures and from ending.
def test_a_flood_of_wishes_ends(viewer):
    hold = []
    viewer.post(lambda: hold.append(time.sleep(0.3)))
    for _ in range(5000):
        viewer.post(lambda: None)
    assert viewer._commands.qsize() <= 1001
    assert until(lambda: viewer._commands.qsize() == 0)


RUNS = """
import sys, threading
from amontons.cli import app
sys.argv = ["amontons", "view", "stack", "--set", "boxes=2", "--no-browser", "--play", "--port", sys.argv[1]]
app()
"""


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


# Seconds from Ctrl-C to the end, which only a machine that does nothing else keeps.
AT_ONCE = pytest.mark.parametrize("seconds", [LONGEST, pytest.param(2.0, marks=pytest.mark.slow_machine)])


# Breaks when Ctrl-C does not end the viewer, or not at once,
# because of a client that says nothing, does not close, or sends as fast as it can.
@pytest.mark.alone
@AT_ONCE
def test_ctrl_c_ends_it_whatever_clients_do(tmp_path, seconds):
    command = [sys.executable, "-u", "-c", RUNS, str(free_port())]
    log = (tmp_path / "log.txt").open("w")
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
    flood = None
    try:
        url = process.stdout.readline().split()[0]
        address = urlsplit(url)
        silent = [socket.create_connection(("127.0.0.1", address.port)) for _ in range(5)]
        half = socket.create_connection(("127.0.0.1", address.port))
        half.sendall(b"GET / HTTP/1.1\r\nHost: loc")
        secret = parse_qs(address.query)["token"][0]
        upgrade = (
            f"GET /{secret} HTTP/1.1\r\nHost: localhost:{address.port}\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: viser-v{viser.__version__}\r\n\r\n"
        )
        deaf = socket.create_connection(("127.0.0.1", address.port))  # reads nothing, answers no close
        deaf.sendall(upgrade.encode())
        flood = subprocess.Popen([sys.executable, "-c", FLOOD, json.dumps([url, viser.__version__])])
        time.sleep(1.5)
        start = time.monotonic()
        process.send_signal(signal.SIGINT)
        process.wait(timeout=LONGEST)
        assert time.monotonic() - start < seconds
        assert process.returncode == 0
        told = (tmp_path / "log.txt").read_text()
        assert "dropped a message" in told
        assert "Traceback" not in told
        for client in (*silent, half, deaf):
            client.close()
    finally:
        process.kill()
        if flood is not None:
            flood.kill()
        process.communicate()
        log.close()


FLOOD = """
import json, sys
from websockets.sync.client import connect
url, version = json.loads(sys.argv[1])
while True:
    try:
        options = dict(subprotocols=["viser-v" + version], max_size=None, proxy=None)
        with connect(url.replace("http", "ws", 1), **options) as s:
            while True:
                s.send(b"nonsense")
    except ConnectionRefusedError:
        break
    except Exception:
        pass
"""


# Breaks when Ctrl-C waits for a step that lasts.
@pytest.mark.alone
@AT_ONCE
def test_ctrl_c_does_not_wait_for_a_step(seconds):
    program = (
        "import time, amontons.simulation.simulation as s\n"
        "s.Simulation.step = lambda self: time.sleep(3600)\n" + RUNS
    )
    command = [sys.executable, "-u", "-c", program, str(free_port())]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        assert process.stdout.readline().startswith("http")
        time.sleep(0.5)
        start = time.monotonic()
        process.send_signal(signal.SIGINT)
        process.wait(timeout=LONGEST)
        assert time.monotonic() - start < seconds
    finally:
        process.kill()
        process.communicate()
