#!/usr/bin/env python3
"""Uses `tactus view` as a person does, under Xvfb: step, pause, orbit, tools, panels, resize, restart, close.

The window's title tells state and frame, so it can be waited for. Exits with 77 where Xvfb, xdotool or ImageMagick is absent, or
the program has no windows.
usage: window_script.py PROGRAM [--keep FOLDER]
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

SCENE = """
source: {kind: none, fps: 60}
bodies:
  - name: box
    shape: {kind: box, size_m: [0.3, 0.1, 0.3]}
    placement: {position_m: [0, 0.05, 0]}
    spacing_m: 0.025
    material: {model: tled, young_modulus_pa: 5000}
obstacles:
  - {name: floor, kind: plane}
  - {name: ball, kind: sphere, radius_m: 0.03, placement: {position_m: [0, 0.2, 0]}, held: true}
"""
WIDTH, HEIGHT = 800, 600
SOON_S = 30  # a loaded machine isn't an error


def skip(why: str) -> None:
    print("skipped: " + why)
    sys.exit(77)


class Display:
    """An X server on a number that is free; it stays when its last client goes."""

    def __enter__(self):
        read, write = os.pipe()
        self.server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "1920x1080x24", "-nolisten", "tcp", "-noreset"],
                                       pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as told:
            number = told.readline().strip()  # not os.read: Xvfb writes the end of the line by itself
        if not number:
            skip("Xvfb doesn't start")
        os.environ["DISPLAY"] = ":" + number
        return self

    def __exit__(self, *_):
        self.server.terminate()
        self.server.wait()


class Window:
    def __init__(self, program: str, folder: pathlib.Path, *flags: str, file: str = "small.yaml", size: str = f"{WIDTH}x{HEIGHT}"):
        self.folder = folder
        self.process = subprocess.Popen([program, "view", file, "--devices", "cpu", "--size", size, *flags], cwd=folder)
        self.id = ""
        self.wait_for("", "a window")
        self.x("windowfocus", self.id)

    def x(self, *words: str) -> str:
        return subprocess.run(["xdotool", *words], capture_output=True, text=True, timeout=20).stdout.strip()

    def title(self) -> str:
        if not self.id:
            self.id = self.x("search", "--onlyvisible", "--name", "^tactus:").split("\n")[0]
        return self.x("getwindowname", self.id) if self.id else ""

    def wait_for(self, pattern: str, what: str) -> str:
        end = time.monotonic() + SOON_S
        while time.monotonic() < end:
            assert self.process.poll() is None, f"the program ended with {self.process.returncode} before: {what}"
            title = self.title()
            if title and re.search(pattern, title):
                return title
            time.sleep(0.05)
        raise AssertionError(f"not in {SOON_S} s: {what}; the title is '{self.title()}'")

    def frame(self) -> int:
        return int(re.search(r"frame (\d+)", self.wait_for(r"frame \d+", "a frame"))[1])

    def key(self, *keys: str) -> None:
        self.x("key", *keys)

    def shot(self, name: str) -> pathlib.Path:
        """As it is now: frames may go on. (Packed quickly: -quality 10.)"""
        path = self.folder / f"{name}.png"
        subprocess.run(["import", "-window", self.id, "-quality", "10", path], check=True, timeout=SOON_S)
        return path

    def drag(self, begin: tuple, end: tuple, button: int = 1, held_s: float = 0, name: str = "") -> None:
        """In small steps, as a hand: the window sees where the mouse was pressed before it moves. Then the button stays pressed for a
        while, and a picture is taken."""
        self.x("mousemove", "--window", self.id, str(begin[0]), str(begin[1]), "sleep", "0.5", "mousedown", str(button))
        for i in range(1, 6):
            x, y = (begin[k] + (end[k] - begin[k]) * i // 5 for k in (0, 1))
            self.x("mousemove", "--window", self.id, str(x), str(y), "sleep", "0.05")
        time.sleep(held_s)
        if name:
            self.shot(name)
        self.x("mouseup", str(button), "sleep", "0.2")

    def grab(self, name: str) -> pathlib.Path:
        """Once two pictures in a row are the same: what was asked for is drawn by then."""
        path, again = self.folder / f"{name}.png", self.folder / "again.png"
        end = time.monotonic() + SOON_S
        subprocess.run(["import", "-window", self.id, "-quality", "10", path], check=True, timeout=SOON_S)
        while time.monotonic() < end:
            time.sleep(0.4)
            subprocess.run(["import", "-window", self.id, "-quality", "10", again], check=True, timeout=SOON_S)
            same = psnr_dB(path, again) > 99
            again.replace(path)
            if same:
                return path
        raise AssertionError(f"the picture '{name}' doesn't come to rest")


def psnr_dB(a: pathlib.Path, b: pathlib.Path) -> float:
    told = subprocess.run(["compare", "-metric", "PSNR", a, b, "null:"], capture_output=True, text=True, timeout=60).stderr
    found = re.match(r"\s*(inf|[\d.]+)", told)
    assert found, f"compare says: {told}"
    value = float(found[1])
    return 100.0 if value == float("inf") or value == 0 and "inf" in told else value


def size_of(path: pathlib.Path) -> tuple:
    return tuple(int(n) for n in subprocess.run(["identify", "-format", "%w %h", path], capture_output=True, text=True).stdout.split())


def check(condition: bool, what: str) -> None:
    assert condition, what
    print("ok: " + what, flush=True)


def use(program: str, folder: pathlib.Path) -> None:
    window = Window(program, folder, "--pause", "--no-panels")
    window.wait_for("paused, frame 1$", "the first frame, paused")
    first = window.grab("first")

    window.key("s")
    saved, end = folder / "small-1.png", time.monotonic() + SOON_S
    while not saved.exists() and time.monotonic() < end:
        time.sleep(0.1)
    time.sleep(0.5)
    # The same drawing. A picture that is off by one pixel has 25 dB.
    value = psnr_dB(first, saved)
    check(value >= 40, f"the window's picture is the offscreen one: {value:.1f} dB")

    for number in (2, 3):
        window.key("period")
        window.wait_for(f"paused, frame {number}$", f"one step to frame {number}")
    check(True, "'.' makes one step")

    stepped = window.grab("stepped")
    window.drag((400, 450), (520, 420))
    orbited = window.grab("orbited")
    check(psnr_dB(stepped, orbited) < 35, "a drag orbits")
    window.key("v")
    back = window.grab("back")
    check(psnr_dB(stepped, back) > 60, "v goes back to the scene's view")
    window.x("mousemove", "--window", window.id, "400", "450", "click", "4")
    check(psnr_dB(stepped, window.grab("zoomed")) < 35, "the wheel zooms")
    window.key("v")
    window.grab("back")

    window.x("keydown", "shift")
    window.drag((400, 250), (420, 330))
    window.x("keyup", "shift")
    for _ in range(10):
        number = window.frame()
        window.key("period")
        window.wait_for(f"frame {number + 1}$", "a step with the tool")
    check(psnr_dB(stepped, window.grab("tool")) < 45, "the tool follows the mouse")

    window.key("Tab")
    panels = window.grab("panels")
    check(psnr_dB(folder / "tool.png", panels) < 30, "tab shows panels")
    window.drag((554, 416), (620, 416))  # gravity along y
    check(psnr_dB(panels, window.grab("slider")) < 60, "a slider moves")
    window.key("h")
    check(psnr_dB(panels, window.grab("help")) < 30, "h shows the help")
    window.key("h")
    window.key("Tab")

    window.x("windowsize", window.id, "1000", "700")
    time.sleep(1)
    check(size_of(window.grab("resized")) == (1000, 700), "the picture follows the window's size")

    number = window.frame()
    window.key("space")
    window.wait_for("running, frame", "space goes on")
    window.wait_for(rf"frame ({'|'.join(str(n) for n in range(number + 5, number + 400))})$", "frames go on")
    window.key("space")
    window.wait_for("paused, frame", "space pauses")
    number, end = -1, time.monotonic() + SOON_S
    while number != window.frame() and time.monotonic() < end:  # the frame that ran is shown
        number = window.frame()
        time.sleep(1)
    check(window.frame() == number, "space pauses")
    window.key("k")
    for i in (1, 2, 3):
        window.key("period")
        window.wait_for(f"paused, frame {number + i}$", "a step after the kept frame")
    window.key("b")
    window.wait_for(f"paused, frame {number + 1}$", "back to the frame after the kept one")
    check(True, "k keeps a frame, b goes back to it")
    for _ in range(3):  # frames that ran were not all seen
        number = window.frame() + 1
        window.key("period")
        window.wait_for(f"paused, frame {number}$", "a step to look back at")
    present = window.grab("present")
    for key, shown in (("Left", number - 1), ("Left", number - 2), ("Right", number - 1), ("Home", 1)):
        window.key(key)
        window.wait_for(f"paused, frame {shown}$", f"{key} shows frame {shown}")
    window.key("Tab")
    check(psnr_dB(present, window.grab("past")) < 45, "Home shows the first frame that was seen, left and right their neighbours")
    window.key("Tab")
    window.key("End")
    window.wait_for(f"paused, frame {number}$", "End shows the present")
    check(psnr_dB(present, window.grab("present again")) > 60, "End shows the present")
    window.key("Left", "Left", "Left")
    window.wait_for(f"paused, frame {number - 3}$", "three frames back")
    window.key("b")
    window.wait_for(f"paused, frame {number - 2}$", "b simulates again from there")
    check(True, "b simulates again from the frame that is shown")
    window.key("r")
    window.wait_for("paused, frame 1$", "restart")
    check(True, "r starts again")

    window.key("space")
    window.wait_for("running, frame", "runs before it is closed")
    begin = time.monotonic()
    window.key("q")
    code = window.process.wait(timeout=10)
    took = time.monotonic() - begin
    # 0.2 s of two cores that do nothing else, xdotool's 0.08 s among them; up to 1.5 s where a dozen programs share them.
    check(code == 0 and took < 4, f"closed after {took:.2f} s with exit code {code}")


def cut_and_pull(program: str, folder: pathlib.Path) -> None:
    """The box's top is under the middle of the picture."""
    window = Window(program, folder, "--no-panels", "--tool", "scalpel")
    window.wait_for(r"frame [1-9]\d", "frames")
    before = window.shot("whole")
    window.x("keydown", "shift")
    window.drag((330, 300), (480, 300), held_s=3, name="cutting")
    window.x("keyup", "shift")
    check(psnr_dB(before, folder / "cutting.png") < 40, "shift + drag leads the scalpel through the box")
    cut = window.shot("cut")
    window.x("keydown", "ctrl")
    window.drag((400, 330), (400, 130), held_s=3, name="pulled")
    window.x("keyup", "ctrl")
    check(psnr_dB(cut, folder / "pulled.png") < 30, "ctrl + drag pulls what is under the mouse")
    time.sleep(3)
    let_go = window.shot("let go")
    check(psnr_dB(folder / "pulled.png", let_go) < 30, "which falls back when it is let go")
    window.key("t")
    window.key("q")
    check(window.process.wait(timeout=10) == 0, "t takes the next tool")


def hook(program: str, folder: pathlib.Path) -> None:
    """Before the box and down, away from the eye, so that it is below the box, and up. The bars have a budget of 0.1 ms, which no frame
    keeps."""
    window = Window(program, folder, "--tool", "hook", "--budget", "0.1ms", "--no-panels")
    window.wait_for(r"frame [1-9]\d", "frames")
    window.key("c")  # no arrows
    window.x("keydown", "shift")
    window.drag((600, 300), (600, 590), held_s=3)
    for _ in range(10):
        window.x("click", "4", "sleep", "0.2")
    time.sleep(2)
    under = window.shot("hook under")
    window.drag((600, 590), (600, 250), held_s=4, name="hook lifts")
    window.x("keyup", "shift")
    edges = [folder / "edge before.png", folder / "edge after.png"]  # the box's lower one, beside the hook
    for path, picture in zip(edges, (under, folder / "hook lifts.png")):
        subprocess.run(["convert", picture, "-crop", "250x200+150+400", "+repage", path], check=True)
    check(psnr_dB(*edges) < 40, f"shift + drag lifts the box with the hook: {psnr_dB(*edges):.1f} dB")
    window.key("Tab")
    window.key("space")
    window.wait_for("paused", "a pause")
    window.grab("over the budget")
    window.key("q")
    check(window.process.wait(timeout=10) == 0, "a budget has its marks")


def cameras(program: str, folder: pathlib.Path) -> None:
    """A rig whose cameras 2 and 5 are swapped, so the doctor has something to say: it is drawn in the strip, and where they stand."""
    shutil.rmtree(folder / "film", ignore_errors=True)
    subprocess.run([program, "synth", "hand", "--moving", "--frames", "12", "--out", "film"], cwd=folder, check=True, capture_output=True)
    rig = folder / "film" / "rig.yaml"
    other = {"2": "5", "5": "2"}
    rig.write_text(re.sub(r"cameras/cam([25])\.yaml", lambda m: f"cameras/cam{other[m[1]]}.yaml", rig.read_text()))
    window = Window(program, folder, file="film/rig.yaml", size="1280x720")
    window.wait_for("ended, frame 12$", "the end of the film")
    time.sleep(3)  # for the doctor
    seen = window.grab("cameras")
    strip = "600x200+340+510"

    def differ(a: pathlib.Path, b: pathlib.Path) -> bool:
        cut = [folder / f"strip {i}.png" for i in (0, 1)]
        for path, picture in zip(cut, (a, b)):
            subprocess.run(["convert", picture, "-crop", strip, "+repage", path], check=True)
        return psnr_dB(*cut) < 25

    window.key("i")
    hidden = window.grab("no cameras")
    check(differ(seen, hidden), "i hides the cameras' images")
    window.key("i")
    check(not differ(seen, window.grab("cameras again")), "and shows them")
    window.key("q")
    check(window.process.wait(timeout=10) == 0, "a rig with a fault closes as others do")


def main() -> None:
    program = str(pathlib.Path(sys.argv[1]).resolve())
    for tool in ("Xvfb", "xdotool", "import", "compare", "convert"):
        if shutil.which(tool) is None:
            skip(f"there is no {tool}")
    told = subprocess.run([program, "info"], capture_output=True, text=True).stdout
    if "tactus view opens no window" in told:
        skip("this build has no windows")
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    os.environ.update({"LIBGL_ALWAYS_SOFTWARE": "1"})
    with tempfile.TemporaryDirectory() as made:
        folder = pathlib.Path(sys.argv[3] if len(sys.argv) > 3 else made).resolve()
        folder.mkdir(exist_ok=True)
        (folder / "small.yaml").write_text(SCENE)
        for words, code, text in (
            (["nowhere.yaml"], 1, "'nowhere.yaml': no such file"),
            (["small.yaml", "--size", "10x10"], 2, "--size '10x10': expected pixels as 1280x720"),
            (["small.yaml", "--budget", "11"], 2, "--budget '11': expected the time of a frame with its unit"),
            (["small.yaml", "--tool", "bal"], 2, "--tool 'bal': the scene has nothing of this name with 'held: true'; did you mean 'ball'?"),
        ):
            ran = subprocess.run([program, "view", *words], cwd=folder, env=environment, capture_output=True, text=True)
            check(ran.returncode == code and text in ran.stderr, f"{' '.join(words)}: {ran.stderr.strip()}")
        refused = subprocess.run([program, "view", "small.yaml"], cwd=folder, env=environment, capture_output=True, text=True)
        check(refused.returncode == 1 and "DISPLAY" in refused.stderr and refused.stderr.count("\n") == 1,
              "no display: one message with the way out")
        with Display():
            use(program, folder)
            cut_and_pull(program, folder)
            hook(program, folder)
            cameras(program, folder)


main()
