// pico_board: runs the image of a Raspberry Pi Pico, instruction by instruction (rp2040js), and gives its USB line to others.
//
//     node pico_board.mjs RP2040JS ROM.bin IMAGE.bin --script            the script on stdin, what the board says on stdout
//     node pico_board.mjs RP2040JS ROM.bin IMAGE.bin --socket PATH       a Unix socket; prints "ready PATH"
//
// Script and output are those of avr_board: "US HEX...", "US low GP...", "US open GP...", "US stop"; "US HEX" for each byte, in
// the board's own time.
// A board that is a bridge: prints "US >HEX" for each byte on UART 0, to the controller, and "US #HEX..." for a line of the log on
// UART 1; "US device HEX..." is what a controller says. --limits FILE is its configuration.
// --memory FILE keeps the last two sectors of the flash there; --straps N closes these straps (bit 0: GP2). RP2040JS is
// the directory of that package.
import fs from 'node:fs';
import net from 'node:net';
import path from 'node:path';

const [library, romFile, imageFile, ...rest] = process.argv.slice(2);
const option = name => rest.includes(name) ? rest[rest.indexOf(name) + 1] : undefined;
const { Simulator, USBCDC, ConsoleLogger, LogLevel } =
    await import(path.resolve(library, 'dist/esm/index.js'));

const NANOS_PER_CYCLE = 8, SECTOR = 4096, FLASH = 2 * 1024 * 1024, KEPT = FLASH - 2 * SECTOR;
const fail = text => { console.error(`pico_board: ${text}`); process.exit(2); };

function bootRom() {
    const bytes = new Uint8Array(16 * 1024);
    bytes.set(fs.readFileSync(romFile));
    const view = new DataView(bytes.buffer);
    for (let from = 0x200, to = 0x100; ; from += 8, to += 4) { // see minirom.c
        const code = view.getUint32(from, true), address = view.getUint32(from + 4, true);
        if (code === 0) {
            view.setUint16(0x18, address, true);
            break;
        }
        view.setUint16(to, code, true);
        view.setUint16(to + 2, address, true);
    }
    return new Uint32Array(bytes.buffer);
}

const { rp2040: mcu, clock } = new Simulator();
mcu.logger = new ConsoleLogger(LogLevel.Error);
mcu.flash.fill(0xff);
mcu.flash.set(fs.readFileSync(imageFile), 0);
const memory = option('--memory');
if (memory && fs.existsSync(memory))
    mcu.flash.set(fs.readFileSync(memory), KEPT);
const limits = option('--limits');
if (limits)
    mcu.flash.set(fs.readFileSync(limits), KEPT);
mcu.bootrom.set(bootRom());
mcu.onBreak = code => {
    const [at, second, third] = mcu.core.registers;
    if (code === 1)
        mcu.flash.fill(0xff, at, at + second);
    else if (code === 2)
        for (let i = 0; i < third; i++)
            mcu.flash[at + i] &= mcu.readUint8(second + i); // flash is erased to ones and programmed to zeros
    else
        fail(`breakpoint ${code} at 0x${mcu.core.PC.toString(16)}`);
};
const closed = Number(option('--straps') ?? 0);
[2, 3, 4, 5].forEach((pin, bit) => mcu.gpio[pin].setInputValue((closed >> bit & 1) === 0)); // it has no pull-ups
for (let pin = 6; pin <= 21; pin++)
    mcu.gpio[pin].setInputValue(true);
const cdc = new USBCDC(mcu.usbCtrl);
let connected = false;
cdc.onDeviceConnected = () => { connected = true; };
mcu.core.reset();

const micros = () => Math.floor(clock.nanos / 1000);
function runUntil(us) {
    while (micros() < us) {
        if (mcu.core.waiting)
            clock.tick(Math.min(clock.nanosToNextAlarm, us * 1000 - clock.nanos) || NANOS_PER_CYCLE);
        else
            clock.tick(mcu.core.executeInstruction() * NANOS_PER_CYCLE);
    }
}
const save = () => { if (memory) fs.writeFileSync(memory, mcu.flash.subarray(KEPT, FLASH)); };

let logLine = '';
mcu.uart[0].onByte = byte => console.log(`${micros()} >${byte.toString(16).padStart(2, '0')}`);
mcu.uart[1].onByte = byte => {
    if (byte === 10)
        console.log(`${micros()} ${logLine}`);
    logLine = byte === 10 ? '' : logLine + String.fromCharCode(byte);
};

if (rest.includes('--script')) {
    cdc.onSerialData = bytes => bytes.forEach(b => console.log(`${micros()} ${b.toString(16).padStart(2, '0')}`));
    for (const line of fs.readFileSync(0, 'utf8').split('\n')) {
        const [us, ...what] = line.trim().split(/\s+/);
        if (!/^\d+$/.test(us))
            continue;
        runUntil(Number(us));
        if (what[0] === 'stop' || what[0] === 'off') {
            save();
            process.exit(0);
        }
        if (what[0] === 'low' || what[0] === 'open') {
            what.slice(1).forEach(pin => mcu.gpio[Number(pin)].setInputValue(what[0] === 'open'));
            continue;
        }
        if (!connected)
            fail(`USB is not connected at ${us} us`);
        if (what[0] === 'device') {
            what.slice(1).forEach(byte => mcu.uart[0].feedByte(parseInt(byte, 16)));
            continue;
        }
        what.forEach(byte => cdc.sendSerialByte(parseInt(byte, 16)));
    }
    fail("the script has no end: it lacks a line 'US stop'");
}

const where = option('--socket') ?? fail('--script or --socket PATH');
let client;
cdc.onSerialData = bytes => client?.write(Buffer.from(bytes));
while (!connected)
    runUntil(micros() + 1000);
net.createServer(socket => {
    client = socket;
    socket.on('data', bytes => bytes.forEach(byte => cdc.sendSerialByte(byte)));
    socket.on('close', () => { client = undefined; });
}).listen(where, () => console.log(`ready ${where}`));
const turn = () => { runUntil(micros() + 1000); setImmediate(turn); };
turn();
for (const signal of ['SIGTERM', 'SIGINT'])
    process.on(signal, () => { save(); fs.rmSync(where, { force: true }); process.exit(0); });
