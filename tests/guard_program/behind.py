"""Puts a guard that allows nearly everything behind the programs that the tests of the host library run.

behind.py emu ARGS...      dryrig-emu ARGS, with a guard before it: prints the guard's `ready` line, runs until a signal
behind.py arm PROGRAM ARGS... arms the guard at the port that is among ARGS, and becomes PROGRAM ARGS

Where the second channel of the guard at /dev/pts/N is: $BEHIND/N."""
import os
import signal
import subprocess
import sys

import emu
import guard

MICROSTEPS = {"mpc": {"MP-225": 0.0625, "MP-285": 0.0625, "MP-265": 0.0625, "MP-845": 0.046875, "MT-800": 0.078125},
              "trio": {"MP-845": 0.09375, "MP-285": 0.125}}
TRAVEL_UM = {("mpc", "MP-265"): (25000, 12500, 25000), ("mpc", "MT-800"): (22000, 22000, 22000),
             ("trio", "MP-845"): (25000.03125, 25000.03125, 25000.03125)} # all of it, or home and work are refused
CONFIG = {"mpc": 'profile = "mpc-200"; firmware = "3.21"; mpc_home = "zero"; allow_stream = true;',
          "trio": 'profile = "trio-mp245a"; firmware = "3.12"; external_switch5_on = true; external_switch6_on = false;'}
DRIVE = """{ number = %d; device = "%s"; microstep_um = %s; %s max_move_um = 50000;
    box_um = { x = (0, %s); y = (0, %s); z = (0, %s); }; }"""


def config(kind, stages):
    drives = [DRIVE % (i + 1, stage, MICROSTEPS[kind][stage], "switch8_on = true;" if kind == "mpc" else "", *TRAVEL_UM.get((kind, stage), (25000, 25000, 25000)))
              for i, stage in enumerate(stages)]
    return ("format = 1; revision = 1; knobs_locked = true; margin_um = 0; unstoppable_ms = 60000; allow_calibrate = true; "
            f"{CONFIG[kind]} drives = ( {', '.join(drives)} );")


def emulator(args):
    stages = [args[i + 1] for i, arg in enumerate(args) if arg == "--device"]
    with emu.directory() as directory:
        controller = emu.start(*args, stderr=subprocess.DEVNULL)
        path = controller.stdout.readline().decode().split()[1]
        behind = guard.Guard(directory, path, config(args[0], stages), wait=None)
        socket = os.path.join(os.environ["BEHIND"], os.path.basename(behind.path))
        os.symlink(behind.socket, socket)
        try:
            behind.wait_for("disarmed")
            behind.order("confirm")
            print("ready", behind.path, flush=True)
            signal.sigwait({signal.SIGTERM, signal.SIGINT})
        finally:
            os.unlink(socket)
            behind.stop()
            controller.terminate()
            controller.wait()


def order(socket, line):
    with guard.Channel(socket) as channel:
        return channel.order(line)


def arm(program, args):
    ports = [arg for arg in [*args, os.environ.get("DRYRIG_PORT", "")] if arg.startswith("/dev/pts/")]
    socket = os.path.join(os.environ["BEHIND"], os.path.basename(ports[0])) if ports else ""
    if os.path.exists(socket):
        # The program before has gone; the guard has seen it, or will: until then what is armed would be disarmed.
        emu.wait_until(lambda: not order(socket, "status")["host_open"], "the port to be free")
        order(socket, "allow-calibrate")
        emu.wait_until(lambda: order(socket, "arm")["ok"], "the guard to be armed")
    os.execv(program, [program, *args])


if __name__ == "__main__":
    if sys.argv[1] == "emu":
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGINT})
        emulator(sys.argv[2:])
    else:
        arm(sys.argv[2], sys.argv[3:])
