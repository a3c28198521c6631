#!/usr/bin/env python3
"""Offers one photo to a session, signed, and sends its bytes. It needs what a program of one's own has: lcm-gen's types,
Python's sockets, and PyNaCl (python3-nacl) for the signatures.

  lcm-gen -p --ppath types lcmtypes/*.lcm
  PYTHONPATH=types clients/examples/offer_photo.py LINK PHOTO

LINK is printed by `skein invite --session DIR --role agent`. Exit codes: 0 the photo is stored or was there already,
1 it was refused or an error, 2 bad usage.
"""
import base64
import hashlib
import pathlib
import re
import socket
import struct
import sys
import time

import nacl.exceptions
import nacl.signing
from skein.blob_chunk_t import blob_chunk_t
from skein.blob_request_t import blob_request_t
from skein.image_ack_t import image_ack_t
from skein.image_offer_t import image_offer_t

IDENTIFIER = b'SKN1'
INGEST = 1  # role
SIGNATURE_BYTES = 64
MAX_DATAGRAM_BYTES = 65535
MAX_CHUNK_BYTES = 24 << 10


class Invitation:
    """skein://HOST:PORT/PROVIDER/SESSION/ROLE/NAME/CODE"""

    def __init__(self, link):
        if not link.startswith('skein://'):
            raise ValueError('no skein:// link')
        parts = link.removeprefix('skein://').split('/')
        if len(parts) != 6:
            raise ValueError('the link is cut')
        self.host, port = parts[0].rsplit(':', 1)
        self.port = int(port)
        self.provider, _, ttl = parts[1].partition('-')
        if self.provider not in ('udpm', 'tcpq'):
            raise ValueError('this program has no TLS: join the session with `skein agent`')
        self.ttl = int(ttl or 0)
        self.session, self.name = parts[2], parts[4]
        code = base64.urlsafe_b64decode(parts[5] + '=' * (-len(parts[5]) % 4))
        self.root = nacl.signing.VerifyKey(code[:32])
        self.key = nacl.signing.SigningKey(code[32:64])
        self.certificate = code[64:]

    def bus(self, port_offset, channels):
        bus = UdpmBus if self.provider == 'udpm' else TcpqBus
        return bus(self.host, self.port + port_offset, self.ttl, channels)


class UdpmBus:
    """LCM's multicast: a datagram is "LC02", a sequence number, the channel with a zero, the message."""

    def __init__(self, group, port, ttl, channels):
        self.address, self.channels, self.sequence = (group, port), channels, 0
        self.out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, ttl)
        self.into = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.into.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.into.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self.into.bind(self.address)
        membership = socket.inet_aton(group) + socket.inet_aton('0.0.0.0')
        self.into.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)

    def publish(self, channel, message):
        self.out.sendto(b'LC02' + struct.pack('>I', self.sequence) + channel.encode() + b'\0' + message, self.address)
        self.sequence = (self.sequence + 1) & 0xffffffff

    def receive(self, timeout_s):
        """The next (channel, message) of the channels, or None."""
        self.into.settimeout(timeout_s)
        try:
            datagram = self.into.recv(MAX_DATAGRAM_BYTES)
        except TimeoutError:
            return None
        channel, zero, message = datagram[8:].partition(b'\0')
        name = channel.decode('ascii', 'replace')
        return (name, message) if datagram[:4] == b'LC02' and zero and name in self.channels else None


class TcpqBus:
    """LCM's relay: a greeting, then frames of numbers in big endian (libs/net/transport/tcpq_wire.h)."""

    PUBLISH, SUBSCRIBE = 1, 2

    def __init__(self, host, port, _, channels):
        self.link = socket.create_connection((host, port), timeout=10)
        self.buffer = b''
        self.link.sendall(struct.pack('>II', 0x287617fb, 0x0100))
        for channel in channels:
            self.link.sendall(struct.pack('>I', self.SUBSCRIBE) + self.sized(channel.encode()))
        while not self.has(8):
            self.fill(10)
        self.take(8)  # the relay's greeting

    @staticmethod
    def sized(data):
        return struct.pack('>I', len(data)) + data

    def publish(self, channel, message):
        self.link.settimeout(10)
        self.link.sendall(struct.pack('>I', self.PUBLISH) + self.sized(channel.encode()) + self.sized(message))

    def has(self, size):
        return len(self.buffer) >= size

    def take(self, size):
        taken, self.buffer = self.buffer[:size], self.buffer[size:]
        return taken

    def fill(self, timeout_s):
        self.link.settimeout(timeout_s)
        try:
            more = self.link.recv(1 << 16)
        except TimeoutError:
            return
        if not more:
            raise ConnectionError('the relay has hung up')
        self.buffer += more

    def whole_frame_bytes(self):
        """Of the frame at the front; 0 where it is not all here."""
        if not self.has(8):
            return 0
        message_at = 8 + struct.unpack_from('>I', self.buffer, 4)[0]
        if not self.has(message_at + 4):
            return 0
        end = message_at + 4 + struct.unpack_from('>I', self.buffer, message_at)[0]
        return end if self.has(end) else 0

    def receive(self, timeout_s):
        """The next (channel, message), or None."""
        if not self.whole_frame_bytes():
            self.fill(timeout_s)
        frame = self.take(self.whole_frame_bytes())
        if not frame:
            return None
        message_at = 8 + struct.unpack_from('>I', frame, 4)[0]
        return frame[8:message_at].decode('ascii', 'replace'), frame[message_at + 4:]


def request_channel(owner):
    """Requests for an owner's blobs come here (BlobRequestChannel in libs/net/transport/channels.h). A name in an
    invitation is short enough to be there whole."""
    return 'SKEIN_BLOB_REQUEST_' + re.sub('[^A-Z0-9]', '_', owner.upper())


class Agent:
    def __init__(self, invitation, path):
        self.invitation = invitation
        self.photo = path.read_bytes()
        self.offer = image_offer_t()
        self.offer.session_id = invitation.session
        self.offer.agent = invitation.name
        self.offer.name = path.name
        self.offer.size_bytes = len(self.photo)
        self.offer.blob_id = hashlib.sha256(self.photo).hexdigest()
        self.offer.owner = 'agent.' + invitation.name
        self.counter = 0
        self.main = invitation.bus(0, {'SKEIN_IMAGE_ACK', request_channel(self.offer.owner)})
        self.bulk = invitation.bus(1, set())

    def run(self):
        """Repeats the offer until ingest has decided; its answer."""
        due = 0
        while True:
            if time.monotonic() >= due:
                self.publish(self.main, 'SKEIN_IMAGE_OFFER', self.offer)
                due = time.monotonic() + 0.5
            channel, message = self.main.receive(0.1) or ('', b'')
            # Before it is decoded: whoever hears the network can say anything, on any channel.
            if not self.is_from_ingest(channel, message):
                continue
            if channel == 'SKEIN_IMAGE_ACK':
                ack = image_ack_t.decode(message)
                if self.decides(ack):
                    return ack
            else:
                self.on_request(blob_request_t.decode(message))

    def publish(self, bus, channel, message):
        """The message, then its trailer (libs/net/auth/message_seal.h)."""
        payload = message.encode()
        self.counter = max(self.counter + 1, time.time_ns())
        trailer = struct.pack('<Q', int(self.invitation.session, 16)) + self.invitation.certificate
        trailer += struct.pack('<Q', self.counter)
        trailer += self.invitation.key.sign(self.context('skein-message-1', channel) + payload + trailer).signature
        trailer += struct.pack('<H', len(trailer) + 2 + len(IDENTIFIER)) + IDENTIFIER
        bus.publish(channel, payload + trailer)

    def context(self, *words):
        """What is signed before the bytes: purpose, session and more, each with a zero at its end."""
        return b''.join(word.encode() + b'\0' for word in (words[0], self.invitation.session, *words[1:]))

    def decides(self, ack):
        offered = (self.offer.session_id, self.offer.agent, self.offer.name, self.offer.blob_id)
        return (ack.session_id, ack.agent, ack.name, ack.blob_id) == offered and ack.status != image_ack_t.WAIT

    def is_from_ingest(self, channel, message):
        """Whether the message ends with a trailer of ingest's that the session's root vouches for. A repeated answer does
        no harm here, so that its counter is not looked at."""
        try:
            size, = struct.unpack_from('<H', message, len(message) - 6)
            certificate = message[len(message) - size + 8:len(message) - 6 - SIGNATURE_BYTES - 8]
            claims, by_root = certificate[:-SIGNATURE_BYTES], certificate[-SIGNATURE_BYTES:]
            if message[-4:] != IDENTIFIER or claims[0] != INGEST or len(claims) != 2 + claims[1] + 8 + 32:
                return False
            signed, by_ingest = message[:-6 - SIGNATURE_BYTES], message[-6 - SIGNATURE_BYTES:-6]
            self.invitation.root.verify(self.context('skein-certificate-1') + claims, by_root)
            nacl.signing.VerifyKey(claims[-32:]).verify(self.context('skein-message-1', channel) + signed, by_ingest)
            return True
        except (struct.error, IndexError, ValueError, nacl.exceptions.CryptoError):
            return False

    def on_request(self, request):
        asked = (request.session_id, request.owner, request.blob_id)
        if asked != (self.offer.session_id, self.offer.owner, self.offer.blob_id) or request.max_chunk_bytes <= 0:
            return
        step = min(request.max_chunk_bytes, MAX_CHUNK_BYTES)
        last = min(len(self.photo), request.offset + request.length)
        for offset in range(max(0, request.offset), last, step):
            chunk = blob_chunk_t()
            chunk.session_id, chunk.blob_id, chunk.status = self.offer.session_id, self.offer.blob_id, blob_chunk_t.OK
            chunk.total_bytes, chunk.offset = len(self.photo), offset
            chunk.data = self.photo[offset:min(offset + step, last)]
            chunk.size = len(chunk.data)
            self.publish(self.bulk, request.reply_channel, chunk)


def main():
    if len(sys.argv) != 3:
        sys.exit(print('usage: offer_photo.py LINK PHOTO', file=sys.stderr) or 2)
    try:
        ack = Agent(Invitation(sys.argv[1]), pathlib.Path(sys.argv[2])).run()
    except (OSError, ValueError) as error:
        sys.exit(f'offer_photo.py: {error}')
    print(f'{ack.name}: status {ack.status}, photo {ack.image_id} {ack.reason}')
    sys.exit(ack.status == image_ack_t.REFUSED)


if __name__ == '__main__':
    main()
