// Photos on the image planes of their cameras.
import {
  BufferAttribute, BufferGeometry, DoubleSide, Mesh, MeshBasicMaterial, Quaternion, SRGBColorSpace, TextureLoader, Vector3,
} from 'three';
import { uprightPoint } from '../orientation.js';

export class Pictures {
  constructor(scene, changed) {
    this.scene = scene;
    this.changed = changed;
    this.all = new Map(); // role -> {image, url, mesh, ready}
    this.loader = new TextureLoader();
    this.placed = new Map();
    this.scale = 1;
    this.visible = true;
  }

  // `role`: one picture each ("newest", "selected"); url '': none.
  set(role, image, url, orientation = 1) {
    const old = this.all.get(role);
    if ((old?.url ?? '') === url) return;
    if (old) {
      this.scene.remove(old.mesh);
      old.mesh.geometry.dispose();
      old.mesh.material.map?.dispose();
      old.mesh.material.dispose();
      this.all.delete(role);
    }
    this.changed();
    if (!url) return;
    const geometry = new BufferGeometry();
    const corners = [[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]];
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(corners.flat()), 3));
    const uv = corners.flatMap(([x, y]) => {
      const [u, v] = uprightPoint(orientation, (x + 1) / 2, (y + 1) / 2);
      return [u, 1 - v];
    });
    geometry.setAttribute('uv', new BufferAttribute(new Float32Array(uv), 2));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const material = new MeshBasicMaterial({ side: DoubleSide, toneMapped: false, transparent: true, opacity: 0.95 });
    const mesh = new Mesh(geometry, material);
    mesh.visible = false;
    mesh.matrixAutoUpdate = false;
    mesh.frustumCulled = false;
    mesh.renderOrder = 3;
    const picture = { image, url, mesh, ready: false };
    this.all.set(role, picture);
    this.scene.add(mesh);
    this.loader.load(url, (texture) => {
      if (this.all.get(role) !== picture) {
        texture.dispose();
        return;
      }
      texture.colorSpace = SRGBColorSpace;
      material.map = texture;
      material.needsUpdate = true;
      picture.ready = true;
      this.placeOne(picture);
      this.changed();
    }, undefined, () => {});
  }

  // placed: image -> {centre, q, size}, as Cameras has them
  place(placed, { scale, visible }) {
    Object.assign(this, { placed, scale, visible });
    for (const picture of this.all.values()) this.placeOne(picture);
  }

  placeOne({ image, mesh, ready }) {
    const camera = this.placed.get(image);
    mesh.visible = ready && Boolean(camera) && this.visible;
    if (!camera) return;
    const [w, x, y, z] = camera.q;
    const [sx, sy, sz] = camera.size.map((v) => v * this.scale);
    mesh.matrix.compose(new Vector3(...camera.centre), new Quaternion(x, y, z, w), new Vector3(sx, sy, sz));
    mesh.matrixWorldNeedsUpdate = true;
  }
}
