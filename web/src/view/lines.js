// Lines of a width in pixels (WebGL's own are one pixel wide) and the cameras' frusta: one draw call for all lines of a
// kind, each instance a segment or a camera.
import {
  BufferAttribute, DoubleSide, DynamicDrawUsage, InstancedBufferAttribute, InstancedBufferGeometry, Mesh, NoBlending,
  ShaderMaterial, Vector2,
} from 'three';

const kWiden = /* glsl */ `
  uniform vec2 uViewport; // device pixels
  uniform float uWidth;   // device pixels
  // One end of a segment, moved sideways. Segments that cross the near plane are cut there.
  vec4 widened(vec4 here, vec4 there, float side) {
    float near = 1e-4;
    if (here.w < near && there.w < near) return vec4(2.0, 2.0, 2.0, 1.0);
    if (here.w < near) here = mix(here, there, (near - here.w) / (there.w - here.w));
    if (there.w < near) there = mix(there, here, (near - there.w) / (here.w - there.w));
    vec2 along = (there.xy / there.w - here.xy / here.w) * uViewport;
    float n = length(along);
    vec2 normal = n > 1e-6 ? vec2(-along.y, along.x) / n : vec2(0.0);
    here.xy += side * normal * uWidth / uViewport * here.w;
    return here;
  }
  vec3 turned(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }
`;

const kSegmentVertex = /* glsl */ `
  ${kWiden}
  attribute vec3 iFrom, iTo;
  attribute vec4 iColour;
  varying vec4 vColour;
  void main() {
    mat4 m = projectionMatrix * modelViewMatrix;
    vec4 a = m * vec4(iFrom, 1.0), b = m * vec4(iTo, 1.0);
    bool first = position.x < 0.5;
    gl_Position = widened(first ? a : b, first ? b : a, first ? position.y : -position.y);
    vColour = iColour;
  }
`;

const kColourFragment = /* glsl */ `
  varying vec4 vColour;
  void main() { gl_FragColor = vColour; }
`;

// Instances of attributes of which only the first `count` are shown. Grows by doubling.
function instanced(geometry, sizes) {
  let capacity = 0;
  return (count) => {
    if (count <= capacity) return;
    capacity = Math.max(count, 2 * capacity, 16);
    geometry.dispose();
    for (const [name, size] of Object.entries(sizes)) {
      const attribute = new InstancedBufferAttribute(new Float32Array(size * capacity), size);
      attribute.setUsage(DynamicDrawUsage);
      geometry.setAttribute(name, attribute);
    }
    geometry._maxInstanceCount = undefined;
  };
}

export class Segments extends Mesh {
  // depthTest false: drawn over everything
  constructor({ width = 1.5, depthTest = true } = {}) {
    const geometry = new InstancedBufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array([0, -1, 0, 1, -1, 0, 1, 1, 0, 0, 1, 0]), 3));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    super(geometry, new ShaderMaterial({
      uniforms: { uViewport: { value: new Vector2(1, 1) }, uWidth: { value: width } },
      vertexShader: kSegmentVertex, fragmentShader: kColourFragment,
      transparent: true, depthTest, depthWrite: false, side: DoubleSide,
    }));
    this.cssWidth = width;
    this.frustumCulled = false;
    this.grow = instanced(geometry, { iFrom: 3, iTo: 3, iColour: 4 });
    this.set([]);
  }

  // [{from, to, colour: [r, g, b, a]}]
  set(segments) {
    this.grow(segments.length);
    const { iFrom, iTo, iColour } = this.geometry.attributes;
    segments.forEach((s, i) => {
      iFrom.array.set(s.from, 3 * i);
      iTo.array.set(s.to, 3 * i);
      iColour.array.set(s.colour, 4 * i);
    });
    for (const a of [iFrom, iTo, iColour]) if (a) a.needsUpdate = true;
    this.geometry.instanceCount = segments.length;
    this.visible = segments.length > 0;
  }

  resize(width, height, ratio) {
    this.material.uniforms.uViewport.value.set(width * ratio, height * ratio);
    this.material.uniforms.uWidth.value = this.cssWidth * ratio;
  }
}

// A frustum in units of its half width, half height and depth: apex, image plane, and a mark at its upper side.
const kCorners = [[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]];
const kEdges = [
  ...kCorners.map((c) => [[0, 0, 0], c]),
  ...kCorners.map((c, i) => [c, kCorners[(i + 1) % 4]]),
  [[-0.3, -1, 1], [0, -1.35, 1]], [[0.3, -1, 1], [0, -1.35, 1]],
];

const kFrustumPlace = /* glsl */ `
  attribute vec3 iCentre, iSize;
  attribute vec4 iTurn;     // x, y, z, w
  attribute vec4 iColour;   // alpha: how strongly it is drawn
  uniform float uScale;
  vec3 placed(vec3 v) { return iCentre + turned(iTurn, v * iSize * uScale); }
`;

const kFrustumLines = /* glsl */ `
  ${kWiden}
  ${kFrustumPlace}
  attribute vec3 other;
  attribute float side;
  varying vec4 vColour;
  void main() {
    mat4 m = projectionMatrix * modelViewMatrix;
    gl_Position = widened(m * vec4(placed(position), 1.0), m * vec4(placed(other), 1.0), side);
    vColour = iColour;
  }
`;

const kFrustumFill = /* glsl */ `
  ${kWiden}
  ${kFrustumPlace}
  varying vec4 vColour;
  void main() {
    gl_Position = projectionMatrix * modelViewMatrix * vec4(placed(position), 1.0);
    vColour = vec4(iColour.rgb, iColour.a * 0.16);
  }
`;

const kFrustumPick = /* glsl */ `
  ${kWiden}
  ${kFrustumPlace}
  varying vec4 vColour;
  void main() {
    gl_Position = projectionMatrix * modelViewMatrix * vec4(placed(position), 1.0);
    uint id = uint(gl_InstanceID) + 1u;
    vColour = vec4(float(id & 255u), float((id >> 8) & 255u), float((id >> 16) & 255u), 0.0) / 255.0;
  }
`;

const kInstanceSizes = { iCentre: 3, iSize: 3, iTurn: 4, iColour: 4 };

export class Frusta {
  constructor() {
    const uniforms = { uViewport: { value: new Vector2(1, 1) }, uWidth: { value: 1.5 }, uScale: { value: 1 } };
    this.uniforms = uniforms;
    const material = (vertexShader, more) =>
      new ShaderMaterial({ uniforms, vertexShader, fragmentShader: kColourFragment, side: DoubleSide, ...more });
    this.lines = new Mesh(linesGeometry(), material(kFrustumLines, { transparent: true }));
    this.fill = new Mesh(fillGeometry(), material(kFrustumFill, { transparent: true, depthWrite: false }));
    this.fill.userData.pickMaterial = material(kFrustumPick, { blending: NoBlending });
    this.growers = [this.lines, this.fill].map((mesh) => {
      mesh.frustumCulled = false;
      return instanced(mesh.geometry, kInstanceSizes);
    });
    this.fill.renderOrder = 2;
    this.lines.renderOrder = 1;
    this.cameras = [];
    this.set([]);
  }

  // [{centre, q: [w, x, y, z], size: [half width, half height, depth], colour: [r, g, b, a], image}]
  set(cameras) {
    this.cameras = cameras;
    [this.lines, this.fill].forEach((mesh, m) => {
      this.growers[m](cameras.length);
      const { iCentre, iSize, iTurn, iColour } = mesh.geometry.attributes;
      cameras.forEach((c, i) => {
        iCentre.array.set(c.centre, 3 * i);
        iSize.array.set(c.size, 3 * i);
        iTurn.array.set([c.q[1], c.q[2], c.q[3], c.q[0]], 4 * i);
        iColour.array.set(c.colour, 4 * i);
      });
      for (const a of [iCentre, iSize, iTurn, iColour]) if (a) a.needsUpdate = true;
      mesh.geometry.instanceCount = cameras.length;
      mesh.visible = cameras.length > 0;
    });
  }

  resize(width, height, ratio) {
    this.uniforms.uViewport.value.set(width * ratio, height * ratio);
    this.uniforms.uWidth.value = 1.4 * ratio;
  }
}

function linesGeometry() {
  const position = [];
  const other = [];
  const side = [];
  for (const [a, b] of kEdges) {
    for (const [here, there, s] of [[a, b, -1], [b, a, 1], [b, a, -1], [a, b, -1], [b, a, -1], [a, b, 1]]) {
      position.push(...here);
      other.push(...there);
      side.push(s);
    }
  }
  return frustumGeometry(position, { other: [other, 3], side: [side, 1] });
}

function fillGeometry() {
  const position = [];
  kCorners.forEach((c, i) => position.push(0, 0, 0, ...c, ...kCorners[(i + 1) % 4]));
  for (const i of [0, 1, 2, 0, 2, 3]) position.push(...kCorners[i]);
  return frustumGeometry(position, {});
}

function frustumGeometry(position, others) {
  const geometry = new InstancedBufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(position), 3));
  for (const [name, [values, size]] of Object.entries(others)) {
    geometry.setAttribute(name, new BufferAttribute(new Float32Array(values), size));
  }
  return geometry;
}
