"""Makes a UF2 file, which the Pico's boot loader takes by drag and drop, of a binary image:
uf2.py IMAGE.bin IMAGE.uf2 [ADDRESS]    (0x10000000, the start of the flash)"""
import struct
import sys

MAGIC = 0x0A324655, 0x9E5D5157, 0x0AB16F30
FAMILY_IS_PRESENT, RP2040 = 0x2000, 0xE48BFF56
PAYLOAD = 256
first = int(sys.argv[3], 0) if len(sys.argv) > 3 else 0x10000000

with open(sys.argv[1], "rb") as file:
    image = file.read()
blocks = [image[at:at + PAYLOAD].ljust(PAYLOAD, b"\0") for at in range(0, len(image), PAYLOAD)]
with open(sys.argv[2], "wb") as file:
    for number, block in enumerate(blocks):
        head = struct.pack("<8I", MAGIC[0], MAGIC[1], FAMILY_IS_PRESENT, first + number * PAYLOAD, PAYLOAD, number, len(blocks),
                           RP2040)
        file.write(head + block.ljust(476, b"\0") + struct.pack("<I", MAGIC[2]))
