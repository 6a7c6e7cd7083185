"""What the tests of images share: a run of a simulator on a script, and a few bytes."""
import subprocess


def run(command, events, pins=None):
    """What the board sends: a list of (us, byte). Events: (us, bytes to send, or "stop", "off", "low PIN...", "open PIN...").
    Changes of pins that the command says to watch are added to `pins`: (us, pin, level)."""
    script = "".join(f"{us} {what if isinstance(what, str) else what.hex(' ')}\n" for us, what in events)
    done = subprocess.run(command, input=script, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=800)
    if done.returncode:
        raise AssertionError(done.stderr)
    said = [line.split() for line in done.stdout.splitlines()]
    if pins is not None:
        pins += [(int(line[0]), line[1], int(line[2])) for line in said if len(line) == 3]
    return [(int(line[0]), int(line[1], 16)) for line in said if len(line) == 2]


def point(x, y, z):
    return b"".join(value.to_bytes(4, "little") for value in (x, y, z))


def spaced(us, step_us, frames):
    return [(us + i * step_us, frame) for i, frame in enumerate(frames)]


def between(sent, first_us, last_us):
    return bytes(byte for us, byte in sent if first_us <= us < last_us)
