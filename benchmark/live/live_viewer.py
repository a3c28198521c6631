#!/usr/bin/env python3
"""A page of the live view without a picture: takes events, shapes and chunks as the page does, and tells at its end
(SIGTERM, or when the server closes) what came when, as one JSON object.

    benchmark/live/live_viewer.py HOST PORT

event_s: from a registration's commit to its arrival here. shape_s: from a registration's commit until the shape that
has the photo is here with all chunks. Needs nothing but Python.
"""
import base64, http.client, json, os, signal, socket, struct, sys, threading, time

HOST, PORT = sys.argv[1], int(sys.argv[2])
WANTED_KINDS = {'registration'}


class Page:
    def __init__(self):
        self.events = self.event_bytes = self.head_messages = self.shapes = self.chunks = self.chunk_bytes = self.shape_bytes = 0
        self.event_s, self.shape_s, self.waiting, self.versions, self.points = [], [], {}, {}, {}
        self.wanted, self.ready = {}, threading.Condition()

    def read_exactly(self, count):
        data = b''
        while len(data) < count:
            part = self.socket.recv(count - len(data))
            if not part: raise EOFError
            data += part
        return data

    def read_frame(self):
        first, size = self.read_exactly(2)
        if size == 126: size, = struct.unpack('>H', self.read_exactly(2))
        elif size == 127: size, = struct.unpack('>Q', self.read_exactly(8))
        return first & 15, first >= 128, self.read_exactly(size)

    def read_message(self):
        """The text of the next one. A long one comes in several frames, between which a ping may come (RFC 6455, 5.4)."""
        text = b''
        while True:
            opcode, is_last, payload = self.read_frame()
            if opcode == 8: raise EOFError
            if opcode == 9: self.send_pong(payload)
            if opcode >= 8: continue
            text += payload
            if is_last: return text

    def send_pong(self, payload):
        mask = os.urandom(4)
        self.socket.sendall(bytes([0x8a, 0x80 | len(payload)]) + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))

    def connect(self):
        self.socket = socket.create_connection((HOST, PORT))
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(f'GET /ws HTTP/1.1\r\nHost: {HOST}:{PORT}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n'
                            f'Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n'.encode())
        answer = b''
        while b'\r\n\r\n' not in answer: answer += self.read_exactly(1)
        if b' 101 ' not in answer: raise SystemExit(answer.decode())

    def listen(self):
        try:
            while True:
                text = self.read_message()
                self.take(json.loads(text), len(text))
        except (EOFError, OSError):
            return

    def take(self, message, size):
        now_us = time.time() * 1e6
        if message['type'] == 'events':
            self.event_bytes += size
            for event in message['events']:
                self.events += 1
                if event['kind'] not in WANTED_KINDS: continue
                self.event_s.append((now_us - event['t']) * 1e-6)
                if event['state'] == 'registered': self.waiting[event['image'], event['submap']] = event['t']
        elif message['type'] == 'head': self.head_messages += 1
        elif message['type'] == 'shape' and 'version' in message:
            with self.ready:
                self.wanted[message['submap']] = message['version']
                self.ready.notify()

    def pull(self):
        link = http.client.HTTPConnection(HOST, PORT)

        def get(path):
            link.request('GET', path)
            answer = link.getresponse()
            return answer.status, answer.read()
        while True:
            with self.ready:
                while not self.wanted: self.ready.wait()
                submap, _ = self.wanted.popitem()
            status, body = get(f'/api/submaps/{submap}')
            if status != 200: continue
            shape = json.loads(body)
            self.shapes, self.shape_bytes = self.shapes + 1, self.shape_bytes + len(body)
            whole = True
            for chunk in shape['chunks']:
                place = submap, chunk['id']
                if self.versions.get(place) == chunk['version']: continue
                status, body = get(f"/api/submaps/{submap}/chunks/{chunk['id']}?v={chunk['version']}")
                whole = whole and status == 200
                if status != 200: continue
                self.versions[place] = chunk['version']
                self.chunks, self.chunk_bytes = self.chunks + 1, self.chunk_bytes + len(body)
            self.points[submap] = sum(chunk['points'] for chunk in shape['chunks'])
            now_us = time.time() * 1e6
            if not whole: continue
            for photo in shape['photos']:
                since_us = self.waiting.pop((photo['image'], submap), None)
                if since_us: self.shape_s.append((now_us - since_us) * 1e-6)

    def tell(self, *_):
        def quantiles(values):
            values = sorted(values)
            return {f'p{p}': round(values[int((len(values) - 1) * p / 100)], 4) for p in (50, 95, 100)} if values else {}
        print(json.dumps({'events': self.events, 'event_bytes': self.event_bytes, 'head_messages': self.head_messages,
                          'registrations': len(self.event_s), 'event_s': quantiles(self.event_s), 'shape_s': quantiles(self.shape_s),
                          'shapes': self.shapes, 'shape_bytes': self.shape_bytes, 'chunks': self.chunks, 'chunk_bytes': self.chunk_bytes,
                          'points': sum(self.points.values())}), flush=True)
        os._exit(0)


page = Page()
page.connect()
signal.signal(signal.SIGTERM, page.tell)
threading.Thread(target=page.pull, daemon=True).start()
page.listen()
page.tell()
