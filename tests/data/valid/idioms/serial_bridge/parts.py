import binascii
import random
import struct
from dataclasses import dataclass

FRAME = struct.Struct('<2sBfH')
KINDS = {1: 'temperature', 2: 'pressure'}
FIELD = {'temperature': 'temperature', 'pressure': 'fluid_pressure'}


@dataclass(frozen=True)
class Frame:
    kind: int
    value: float

    def encode(self) -> bytes:
        body = FRAME.pack(b'\xaa\x55', self.kind, self.value, 0)[:-2]
        return body + struct.pack('<H', binascii.crc_hqx(body, 0))

    @classmethod
    def decode(cls, raw: bytes) -> 'Frame':
        magic, kind, value, crc = FRAME.unpack(raw)
        if magic != b'\xaa\x55' or crc != binascii.crc_hqx(raw[:-2], 0):
            raise ValueError(f'bad frame {raw.hex(" ")}')
        return cls(kind, value)


def read(node):
    raw = bytearray(Frame(random.choice((*KINDS,)), random.uniform(10, 30)).encode())
    if random.random() < 0.2:
        raw[3] ^= 0xFF
    node.publish('bytes', {'data': [bytes([b]) for b in raw]})
    return {'data': raw}


def decode(node, message):
    raw = bytes(message.data)
    try:
        frame = Frame.decode(raw)
    except (ValueError, struct.error):
        node.state.bad += 1
        return
    name = KINDS[frame.kind]
    node.publish(name, {'header': {'stamp': node.now(), 'frame_id': 'dev'}, FIELD[name]: frame.value})
    node.publish('crc', int.from_bytes(raw[-2:], 'little'))


def stats(node):
    return f'{node.state.bad} bad frames'
