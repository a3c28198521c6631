#!/usr/bin/env python3
"""Writes an image of one layer without a container engine.

  packaging/oci_image.py --containerfile FILE --root ROOT.TAR --architecture ARCH --name NAME:TAG --output IMAGE.TAR

IMAGE.TAR is an OCI image layout (github.com/opencontainers/image-spec, image-layout.md) as a tar file, which podman, skopeo and
containerd load; docs/deploy.md has what docker needs. The Containerfile says how the image runs; it adds nothing but ROOT.TAR. The time
is $SOURCE_DATE_EPOCH's: equal roots make equal images.
"""
import argparse
import datetime
import gzip
import hashlib
import io
import json
import os
import pathlib
import re
import shutil
import tarfile
import tempfile

MEDIA_TYPE = 'application/vnd.oci.image.'
LEVEL = 6  # gzip's own default
ARCHITECTURES = ('amd64', 'arm64', 'riscv64', 's390x')  # Debian and OCI call these alike
SINGLE = {'USER': 'User', 'WORKDIR': 'WorkingDir'}
LISTS = {'ENTRYPOINT': 'Entrypoint', 'CMD': 'Cmd'}


def run_configuration(containerfile):
    """`config` of an image configuration, from the instructions FROM scratch, ADD root.tar /, and those that say how to run."""
    config = {}
    lines = [line for line in containerfile.read_text().splitlines() if line and not line.startswith('#')]
    if lines[:2] != ['FROM scratch', 'ADD root.tar /']:
        raise SystemExit(f'{containerfile}: must begin with "FROM scratch" and "ADD root.tar /"')
    for line in lines[2:]:
        instruction, value = line.split(maxsplit=1)
        if instruction in SINGLE:
            config[SINGLE[instruction]] = value
        elif instruction in LISTS:
            config[LISTS[instruction]] = json.loads(value)
        elif instruction == 'ENV' and re.fullmatch(r'\w+=[^\s"\'$]+', value):
            config.setdefault('Env', []).append(value)
        elif instruction == 'EXPOSE':
            config['ExposedPorts'] = {f'{port}/tcp': {} for port in value.split()}
        else:
            raise SystemExit(f'{containerfile}: only an engine understands "{line}"')
    return config


class HashedFile(io.RawIOBase):
    """A file that knows the SHA-256 of what was written to it."""

    def __init__(self, file):
        self.file, self.sha256 = file, hashlib.sha256()

    def writable(self):
        return True

    def write(self, data):
        self.sha256.update(data)
        return self.file.write(data)


class Layout:
    """An OCI image layout in a folder."""

    def __init__(self, folder):
        self.folder = folder
        self.blobs = folder / 'blobs' / 'sha256'
        self.blobs.mkdir(parents=True)

    def add_file(self, path, digest, media_type):
        os.replace(path, self.blobs / digest)
        return {'mediaType': MEDIA_TYPE + media_type, 'digest': 'sha256:' + digest, 'size': (self.blobs / digest).stat().st_size}

    def add_json(self, content, media_type):
        path = self.folder / 'new'
        data = json.dumps(content, sort_keys=True).encode()
        path.write_bytes(data)
        return self.add_file(path, hashlib.sha256(data).hexdigest(), media_type)

    def add_layer(self, root):
        """Descriptor of the layer, and the digest of its uncompressed form."""
        path, uncompressed = self.folder / 'new', hashlib.sha256()
        with root.open('rb') as source, path.open('wb') as file:
            packed = HashedFile(file)
            with gzip.GzipFile(filename='', mode='wb', compresslevel=LEVEL, fileobj=packed, mtime=0) as target:
                while block := source.read(1 << 20):
                    uncompressed.update(block)
                    target.write(block)
        return self.add_file(path, packed.sha256.hexdigest(), 'layer.v1.tar+gzip'), 'sha256:' + uncompressed.hexdigest()

    def finish(self, manifest, name):
        index = {'schemaVersion': 2, 'mediaType': MEDIA_TYPE + 'index.v1+json',
                 'manifests': [{**manifest, 'annotations': {'org.opencontainers.image.ref.name': name}}]}
        (self.folder / 'index.json').write_text(json.dumps(index, sort_keys=True))
        (self.folder / 'oci-layout').write_text('{"imageLayoutVersion": "1.0.0"}')


def write_archive(folder, output, time):
    def plain(member):
        member.mtime, member.mode = time, 0o755 if member.isdir() else 0o644
        member.uid = member.gid = 0
        member.uname = member.gname = ''
        return member

    with tarfile.open(output, 'w') as archive:
        for path in sorted(folder.rglob('*')):
            archive.add(path, path.relative_to(folder), recursive=False, filter=plain)


def write_image(options, folder):
    time = int(os.environ.get('SOURCE_DATE_EPOCH', 0))
    created = datetime.datetime.fromtimestamp(time, datetime.timezone.utc).strftime('%Y-%m-%dT%H:%M:%SZ')
    layout = Layout(folder)
    layer, diff_id = layout.add_layer(options.root)
    configuration = {'created': created, 'architecture': options.architecture, 'os': 'linux',
                     'config': run_configuration(options.containerfile),
                     'rootfs': {'type': 'layers', 'diff_ids': [diff_id]},
                     'history': [{'created': created, 'created_by': 'ADD root.tar /'}]}
    manifest = {'schemaVersion': 2, 'mediaType': MEDIA_TYPE + 'manifest.v1+json',
                'config': layout.add_json(configuration, 'config.v1+json'), 'layers': [layer]}
    layout.finish(layout.add_json(manifest, 'manifest.v1+json'), options.name)
    write_archive(folder, options.output, time)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--containerfile', type=pathlib.Path, required=True)
    parser.add_argument('--root', type=pathlib.Path, required=True)
    parser.add_argument('--architecture', choices=ARCHITECTURES, required=True)
    parser.add_argument('--name', required=True)
    parser.add_argument('--output', type=pathlib.Path, required=True)
    options = parser.parse_args()
    # Beside the output: /tmp may be small.
    folder = pathlib.Path(tempfile.mkdtemp(prefix='layout.', dir=options.output.parent))
    try:
        write_image(options, folder)
    finally:
        shutil.rmtree(folder)


if __name__ == '__main__':
    main()
