// The points of one chunk each, as GPU buffers that are replaced in place, and how they are drawn.
import { BufferAttribute, BufferGeometry, Color, Matrix4, NoBlending, Points, Quaternion, ShaderMaterial, Sphere, Vector3 } from 'three';
import { pointOf, prefixOf } from '../chunk.js';
import { kConfidence, rgb } from '../colours.js';
import { chunkPlace, discSize } from '../dense.js';
import * as sim from '../similarity.js';

// Points above the rank and outside of the section are moved out of the picture.
const kPlaced = /* glsl */ `
  attribute float rank; // 0 where it was not computed
  uniform float uRank;
  uniform vec3 uLow, uHigh; // of the section, in the display's frame
  vec4 placed(vec4 seen) {
    vec3 at = (modelMatrix * vec4(position, 1.0)).xyz;
    bool isCut = any(lessThan(at, uLow)) || any(greaterThan(at, uHigh));
    return rank > uRank || isCut ? vec4(2.0, 2.0, 2.0, 1.0) : projectionMatrix * seen;
  }
`;

// Points of a depth map are as large as the surface between them, by their depth in their photo, so that it looks closed.
// All others are as large at the same distance. Some GPUs draw no point above 64 px.
const kSize = /* glsl */ `
  uniform float uPixels;     // diameter at the distance uReference, device pixels
  uniform float uReference;
  uniform float uSmallest;
  uniform float uHalfHeight; // of the picture, device pixels
  uniform float uDisc;       // diameter over depth in the photo; 0: of no photo
  uniform float uOriginDepth; // of the chunk's origin in the photo, in the chunk's steps
  float sizeOf(vec3 at, float depth) {
    float far = max(depth, 1e-6);
    if (uDisc == 0.0) return clamp(uPixels * uReference / far, uSmallest, uPixels * 4.0);
    float diameter = uDisc * (at.z + uOriginDepth) * length(modelViewMatrix[0].xyz);
    return clamp(diameter * projectionMatrix[1][1] * uHalfHeight / far, uSmallest, max(64.0, uSmallest));
  }
`;

// A colour in the tint of its submap.
export const kTinted = /* glsl */ `
  uniform vec3 uTint;
  uniform float uTintShare;
  vec3 tinted(vec3 colour) {
    float grey = dot(colour, vec3(0.299, 0.587, 0.114));
    return mix(colour, uTint * (0.35 + 0.9 * grey), uTintShare);
  }
`;

const kVertex = /* glsl */ `
  ${kPlaced}
  ${kSize}
  ${kTinted}
  attribute vec4 colour; // quality in w: of a dense point its confidence
  uniform vec3 uPaper;
  uniform float uFaded;
  uniform bool uShowsConfidence;
  uniform vec3 uConfidence[${kConfidence.length}]; // as confidenceColour() has it
  varying vec3 vColour;
  vec3 confidenceColour(float confidence) {
    float at = confidence * ${kConfidence.length - 1}.0;
    vec3 mixed = uConfidence[0];
    for (int i = 1; i < ${kConfidence.length}; ++i) mixed = mix(mixed, uConfidence[i], clamp(at - float(i - 1), 0.0, 1.0));
    return mixed;
  }
  void main() {
    vec4 seen = modelViewMatrix * vec4(position, 1.0);
    gl_Position = placed(seen);
    gl_PointSize = sizeOf(position, -seen.z);
    bool isConfidence = uShowsConfidence && uDisc > 0.0;
    vColour = mix(isConfidence ? confidenceColour(colour.w) : tinted(colour.rgb), uPaper, uFaded);
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
  ${kPlaced}
  ${kSize}
  uniform float uBase;
  varying vec4 vId;
  void main() {
    vec4 seen = modelViewMatrix * vec4(position, 1.0);
    gl_Position = placed(seen);
    gl_PointSize = max(sizeOf(position, -seen.z), 3.0);
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
const kFar = 1e30; // a bound beyond all points: shaders need no infinity

// What all points share.
export function pointUniforms() {
  return {
    uPixels: { value: 3 }, uReference: { value: 10 }, uSmallest: { value: 1 }, uHalfHeight: { value: 1 },
    uPaper: { value: new Color() }, uFaded: { value: 0 },
    uLow: { value: new Vector3(-kFar, -kFar, -kFar) }, uHigh: { value: new Vector3(kFar, kFar, kFar) },
    uShowsConfidence: { value: false }, uConfidence: { value: kConfidence.map((hex) => new Vector3(...rgb(hex))) },
  };
}

// box: {low, high}; null: all points are shown.
export function setSection({ uLow, uHigh }, box) {
  const finite = (v) => Math.max(-kFar, Math.min(kFar, v));
  uLow.value.fromArray(box ? box.low.map(finite) : [-kFar, -kFar, -kFar]);
  uHigh.value.fromArray(box ? box.high.map(finite) : [kFar, kFar, kFar]);
}

const ownUniforms = () => ({ uDisc: { value: 0 }, uOriginDepth: { value: 0 }, uRank: { value: kAll } });

// What a submap's points share.
export function tintUniforms() {
  return { uTint: { value: new Vector3(1, 1, 1) }, uTintShare: { value: 0 } };
}

export function pointMaterial(shared) {
  return new ShaderMaterial({
    uniforms: { ...shared, ...ownUniforms() },
    vertexShader: kVertex,
    fragmentShader: kFragment,
  });
}

export function pointPickMaterial(shared) {
  return new ShaderMaterial({
    uniforms: { ...shared, ...ownUniforms(), uBase: { value: 0 } },
    vertexShader: kPickVertex,
    fragmentShader: kPickFragment,
    blending: NoBlending,
  });
}

// Of display_from_submap, submap_from_chunk and the like.
export function matrixOf({ s, q: [w, x, y, z], t }) {
  return new Matrix4().compose(new Vector3(...t), new Quaternion(x, y, z, w), new Vector3(s, s, s));
}

export class ChunkPoints extends Points {
  constructor(material) {
    super(new BufferGeometry(), material);
    this.chunk = null;
    this.pickBase = 0; // the id of its first point while ids are drawn
    this.rank = kAll; // points above it are not drawn
    this.place = sim.identity(); // submap_from_camera of a depth map's points
    this.spacing = 0; // of their samples over their depth
    this.shown = 0;
    this.matrixAutoUpdate = false;
  }

  // Also when ids are drawn, by another material.
  onBeforeRender() {
    const { uniforms } = this.material;
    uniforms.uDisc.value = discSize(this.spacing, this.shown, this.chunk.total);
    uniforms.uOriginDepth.value = this.chunk.origin[2] / this.chunk.step;
    uniforms.uRank.value = this.rank;
    if (uniforms.uBase) uniforms.uBase.value = this.pickBase;
    this.material.uniformsNeedUpdate = true;
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
    this.setPlace(this);
    old.dispose();
  }

  // Of a depth map's points: as photoPlaces() has it.
  setPlace({ place, spacing }) {
    Object.assign(this, { place, spacing });
    this.matrix.copy(matrixOf(chunkPlace(place, this.chunk)));
    this.matrixWorldNeedsUpdate = true;
  }

  // Points that can be picked while their chunk is the same.
  get numPoints() {
    return this.chunk.points;
  }

  // Keeps the first `points`.
  cut(points) {
    if (points < this.chunk.points) this.set(prefixOf(this.chunk, points));
  }

  // Of a point, in the submap's frame.
  own(index) {
    return sim.apply(this.place, pointOf(this.chunk, index));
  }

  // visit(x, y, z) of each point that its rank lets show, in the submap's frame.
  each(visit) {
    const { elements: m } = this.matrix;
    const { position, points } = this.chunk;
    const ranks = this.geometry.getAttribute('rank')?.array;
    for (let i = 0; i < points; ++i) {
      if (ranks && ranks[i] > this.rank) continue;
      const [x, y, z] = [position[4 * i], position[4 * i + 1], position[4 * i + 2]];
      visit(m[0] * x + m[4] * y + m[8] * z + m[12], m[1] * x + m[5] * y + m[9] * z + m[13], m[2] * x + m[6] * y + m[10] * z + m[14]);
    }
  }

  // Points show when their submap's uRank has reached theirs.
  setRanks(ranks) {
    this.geometry.setAttribute('rank', new BufferAttribute(ranks, 1));
    this.chunk.hasRanks = true;
  }

  // At most this share of the chunk's points: they are shuffled, so any prefix is a sample.
  showShare(share) {
    this.shown = Math.min(this.chunk.points, Math.ceil(share * this.chunk.total));
    this.geometry.setDrawRange(0, this.shown);
  }

  dispose() {
    this.geometry.dispose();
  }
}
