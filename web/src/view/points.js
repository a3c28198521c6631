// The points of one chunk each, as GPU buffers that are replaced in place, and how they are drawn.
import { BufferAttribute, BufferGeometry, Color, NoBlending, Points, ShaderMaterial, Sphere, Vector3 } from 'three';

const kSize = /* glsl */ `
  uniform float uPixels;     // diameter at the distance uReference, device pixels
  uniform float uReference;
  uniform float uSmallest;
  float sizeAt(float depth) {
    return clamp(uPixels * uReference / max(depth, 1e-6), uSmallest, uPixels * 4.0);
  }
`;

const kVertex = /* glsl */ `
  ${kSize}
  attribute vec4 colour; // quality in w
  attribute float rank;  // 0 where it was not computed
  uniform float uRank;
  uniform vec3 uTint;
  uniform float uTintShare;
  uniform vec3 uPaper;
  uniform float uFaded;
  varying vec3 vColour;
  void main() {
    vec4 seen = modelViewMatrix * vec4(position, 1.0);
    gl_Position = rank > uRank ? vec4(2.0, 2.0, 2.0, 1.0) : projectionMatrix * seen;
    gl_PointSize = sizeAt(-seen.z);
    float grey = dot(colour.rgb, vec3(0.299, 0.587, 0.114));
    vec3 tinted = mix(colour.rgb, uTint * (0.35 + 0.9 * grey), uTintShare);
    vColour = mix(tinted, uPaper, uFaded);
  }
`;

const kFragment = /* glsl */ `
  varying vec3 vColour;
  void main() {
    vec2 at = gl_PointCoord - 0.5;
    if (dot(at, at) > 0.25) discard;
    gl_FragColor = vec4(vColour, 1.0);
  }
`;

const kPickVertex = /* glsl */ `
  ${kSize}
  attribute float rank;
  uniform float uBase, uRank;
  varying vec4 vId;
  void main() {
    vec4 seen = modelViewMatrix * vec4(position, 1.0);
    gl_Position = rank > uRank ? vec4(2.0, 2.0, 2.0, 1.0) : projectionMatrix * seen;
    gl_PointSize = max(sizeAt(-seen.z), 3.0);
    uint id = uint(uBase) + uint(gl_VertexID);
    vId = vec4(float(id & 255u), float((id >> 8) & 255u), float((id >> 16) & 255u), float((id >> 24) & 255u)) / 255.0;
  }
`;

const kPickFragment = /* glsl */ `
  varying vec4 vId;
  void main() {
    vec2 at = gl_PointCoord - 0.5;
    if (dot(at, at) > 0.25) discard;
    gl_FragColor = vId;
  }
`;

export const kAll = 1e6; // a rank above all

// What all points share.
export function pointUniforms() {
  return {
    uPixels: { value: 3 }, uReference: { value: 10 }, uSmallest: { value: 1 },
    uPaper: { value: new Color() }, uFaded: { value: 0 },
  };
}

export function pointMaterial(shared) {
  return new ShaderMaterial({
    uniforms: { ...shared, uTint: { value: new Vector3(1, 1, 1) }, uTintShare: { value: 0 }, uRank: { value: kAll } },
    vertexShader: kVertex,
    fragmentShader: kFragment,
  });
}

export function pointPickMaterial(shared) {
  return new ShaderMaterial({
    uniforms: { ...shared, uBase: { value: 0 }, uRank: { value: kAll } },
    vertexShader: kPickVertex,
    fragmentShader: kPickFragment,
    blending: NoBlending,
  });
}

export class ChunkPoints extends Points {
  constructor(material) {
    super(new BufferGeometry(), material);
    this.chunk = null;
    this.pickBase = 0;
    this.matrixAutoUpdate = false;
  }

  // The old buffers go only after the new ones are there.
  set(chunk) {
    const old = this.geometry;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(chunk.position, 4));
    geometry.setAttribute('colour', new BufferAttribute(chunk.colour, 4, true));
    const lowest = new Vector3(...chunk.lowest);
    const highest = new Vector3(...chunk.highest);
    geometry.boundingSphere = new Sphere(
      lowest.clone().add(highest).multiplyScalar(0.5), 0.5 * lowest.distanceTo(highest) + 1);
    this.geometry = geometry;
    this.chunk = chunk;
    this.matrix.makeScale(chunk.step, chunk.step, chunk.step).setPosition(...chunk.origin);
    this.matrixWorldNeedsUpdate = true;
    old.dispose();
  }

  // Points show when their submap's uRank has reached theirs.
  setRanks(ranks) {
    this.geometry.setAttribute('rank', new BufferAttribute(ranks, 1));
    this.chunk.hasRanks = true;
  }

  // At most this share of the chunk's points: they are shuffled, so any prefix is a sample.
  showShare(share) {
    if (!this.chunk) return;
    this.shown = Math.min(this.chunk.points, Math.ceil(share * this.chunk.total));
    this.geometry.setDrawRange(0, this.shown);
  }

  dispose() {
    this.geometry.dispose();
  }
}
