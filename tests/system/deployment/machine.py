"""An emulated arm64 board with a Debian on its disk: QEMU, a shell of root's on its second console, serial devices on its USB."""
import os
import re
import select
import signal
import socket
import subprocess
import threading
import time

WITH_US = ["setpriv", "--pdeathsig", "KILL"]  # before a command: it ends when this program does, however that ends
PATIENCE = 900  # s: from power to the shell, on a busy machine


class MachineError(Exception):
    pass


class Machine:
    """Folder of make_image.sh, a disk of one's own, a folder for sockets and the console's log.

    `serial`: names of USB serial converters; each has a socket `serial-NAME` in the folder and NAME as its serial number.
    """

    def __init__(self, image, disk, parcel, folder, serial):
        self.folder = folder
        self.console = os.path.join(folder, "console")
        self.boots = 0
        self.process = None
        self.shell = None
        self.heard = b""
        self.commands = 0
        self.arguments = WITH_US + [
            "qemu-system-aarch64", "-machine", "virt", "-cpu", "cortex-a72", "-accel", "tcg,thread=multi", "-smp", "2", "-m", "1G",
            "-nodefaults", "-display", "none", "-no-reboot",
            "-kernel", os.path.join(image, "kernel"), "-initrd", os.path.join(image, "initramfs"),
            "-append", "console=ttyAMA0 quiet panic=-1",
            "-drive", "file=%s,if=virtio,format=raw" % disk,
            "-drive", "file=%s,if=virtio,format=raw,readonly=on" % parcel,
            "-device", "virtio-serial-pci", "-device", "virtconsole,chardev=shell",
            "-chardev", "socket,id=shell,path=%s,server=on,wait=off" % self.path("shell"),
            "-device", "qemu-xhci"]
        for name in serial:
            self.arguments += ["-chardev", "socket,id=%s,path=%s,server=on,wait=off" % (name, self.path("serial-" + name)),
                               "-device", "usb-serial,chardev=%s,serial=%s,always-plugged=on" % (name, name)]

    def path(self, name):
        return os.path.join(self.folder, name)

    def power_on(self):
        """Returns when the shell answers."""
        self.boots += 1
        for name in os.listdir(self.folder):
            if name == "shell" or name.startswith("serial-"):
                os.unlink(self.path(name))
        console = "%s-%d" % (self.console, self.boots)
        self.process = subprocess.Popen(self.arguments + ["-serial", "file:" + console], stdin=subprocess.DEVNULL)
        deadline = time.monotonic() + PATIENCE
        self.shell = socket.socket(socket.AF_UNIX)
        while self.shell.connect_ex(self.path("shell")) != 0:
            self.check_alive()
            time.sleep(0.1)
        self.shell.settimeout(1)
        # The shell's first line asks for no echo; what it said before that is of no interest. Waits grow, or a machine that is slower
        # than they are would never be done with what it was asked before.
        limit = 5
        while True:
            self.heard = b""
            try:
                self.run("stty -F /dev/hvc0 -echo -onlcr; cd /", limit)
                self.run("true", limit)
                return
            except MachineError:
                limit = min(2 * limit, 120)
                if time.monotonic() > deadline:
                    raise MachineError("no shell %d s after power-on; the console is in %s" % (PATIENCE, console)) from None
                self.check_alive()

    def check_alive(self):
        if self.process.poll() is not None:
            raise MachineError("the emulator has ended with %d" % self.process.returncode)

    def run(self, command, limit=120):
        """→ exit status and output of a command of root's."""
        self.commands += 1
        end = "end-of-%d" % self.commands
        # The mark is put together by the shell, so that an echo of the command does not look like its end.
        self.shell.sendall(("{ %s\n} 2>&1 </dev/null; printf '\\n%%s-of-%d %%d\\n' end $?\n" % (command, self.commands)).encode())
        deadline = time.monotonic() + limit
        while True:
            found = re.search(rb"(?:^|\n)%s (\d+)\r?\n" % end.encode(), self.heard)
            if found:
                text = self.heard[:found.start()].decode(errors="replace").strip()
                self.heard = self.heard[found.end():]
                return int(found.group(1)), text
            if time.monotonic() > deadline:
                raise MachineError("no end of: %s (%d s); so far: %s" % (command, limit, self.heard[-500:].decode(errors="replace")))
            try:
                more = self.shell.recv(65536)
            except socket.timeout:
                self.check_alive()
                continue
            if not more:
                raise MachineError("the machine has gone in: " + command)
            self.heard += more

    def power_cut(self):
        """Power goes: what its file systems had not written yet is lost."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.shell.close()

    def power_off(self):
        self.shell.sendall(b"systemctl poweroff\n")
        self.process.wait(300)
        self.shell.close()

    def close(self):
        if self.process is not None and self.process.poll() is None:
            self.process.kill()
            self.process.wait()


class Line:
    """A serial line from a device's emulator to the machine's converter: what the machine does not take is lost, as on a wire.

    Were the two sockets one, a machine that has no program at the port would stop the emulator until it has one. The device connects to
    `path`; the machine is looked for again whenever it is gone.
    """

    def __init__(self, path, machine_path):
        self.machine_path = machine_path
        if os.path.exists(path):
            os.unlink(path)
        self.server = socket.socket(socket.AF_UNIX)
        self.server.bind(path)
        self.server.listen(1)
        self.ended = False
        self.thread = threading.Thread(target=self.work, daemon=True)
        self.thread.start()

    def work(self):
        device, _ = self.server.accept()
        while not self.ended:
            machine = socket.socket(socket.AF_UNIX)
            machine.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1024)
            if machine.connect_ex(self.machine_path) == 0:
                machine.setblocking(False)
                self.carry(device, machine)
            else:
                self.ended = self.ended or not self.lose(device)
            machine.close()
        device.close()

    def carry(self, device, machine):
        while not self.ended:
            for end in select.select([device, machine], [], [], 0.5)[0]:
                try:
                    data = end.recv(4096)
                    if not data:
                        self.ended = self.ended or end is device
                        return
                    if end is machine:
                        device.sendall(data)
                    else:
                        machine.send(data)
                except BlockingIOError:
                    pass
                except OSError:
                    return

    @staticmethod
    def lose(device):
        """→ whether the device is still there."""
        return not select.select([device], [], [], 0.2)[0] or bool(device.recv(4096))

    def close(self):
        self.ended = True
        self.server.close()
