// The triangles of one chunk of a mesh, as GPU buffers, and how they are drawn.
import { BufferAttribute, BufferGeometry, DoubleSide, Mesh, NoBlending, ShaderMaterial, Sphere, Vector3 } from 'three';
import { pointOf } from '../chunk.js';
import { chunkPlace } from '../dense.js';
import { coarsened } from '../mesh.js';
import * as sim from '../similarity.js';
import { kTinted, matrixOf } from './points.js';

const kAt = /* glsl */ `
  varying vec3 vAt; // in the display's frame
  vec4 placed() {
    vec4 at = modelMatrix * vec4(position, 1.0);
    vAt = at.xyz;
    return viewMatrix * at;
  }
`;

const kCut = /* glsl */ `
  varying vec3 vAt;
  uniform vec3 uLow, uHigh; // of the section
  void cut() {
    if (any(lessThan(vAt, uLow)) || any(greaterThan(vAt, uHigh))) discard;
  }
`;

const kVertex = /* glsl */ `
  ${kAt}
  ${kTinted}
  attribute vec4 colour;
  varying vec3 vColour;
  varying vec3 vSeen;
  void main() {
    vec4 seen = placed();
    vSeen = seen.xyz;
    vColour = tinted(colour.rgb);
    gl_Position = projectionMatrix * seen;
  }
`;

// The photos hold the light already: a little more of it, from the viewer, tells the shape. A triangle is flat.
const kFragment = /* glsl */ `
  ${kCut}
  uniform vec3 uPaper;
  uniform float uFaded;
  varying vec3 vColour;
  varying vec3 vSeen;
  void main() {
    vec3 normal = cross(dFdx(vSeen), dFdy(vSeen)); // before any pixel of it is discarded
    cut();
    float length2 = dot(normal, normal);
    float facing = length2 > 0.0 ? abs(dot(normal * inversesqrt(length2), normalize(vSeen))) : 1.0;
    gl_FragColor = vec4(mix(vColour * (0.7 + 0.3 * facing), uPaper, uFaded), 1.0);
  }
`;

// A triangle has the id of its last vertex.
const kPickVertex = /* glsl */ `
  ${kAt}
  uniform float uBase;
  flat varying vec4 vId;
  void main() {
    gl_Position = projectionMatrix * placed();
    uint id = uint(uBase) + uint(gl_VertexID);
    vId = vec4(float(id & 255u), float((id >> 8) & 255u), float((id >> 16) & 255u), float((id >> 24) & 255u)) / 255.0;
  }
`;

const kPickFragment = /* glsl */ `
  ${kCut}
  flat varying vec4 vId;
  void main() {
    cut();
    gl_FragColor = vId;
  }
`;

// shared: pointUniforms() and tintUniforms()
export function meshMaterial(shared) {
  return new ShaderMaterial({ uniforms: { ...shared }, vertexShader: kVertex, fragmentShader: kFragment, side: DoubleSide });
}

export function meshPickMaterial(shared) {
  return new ShaderMaterial({
    uniforms: { ...shared, uBase: { value: 0 } },
    vertexShader: kPickVertex,
    fragmentShader: kPickFragment,
    side: DoubleSide,
    blending: NoBlending,
  });
}

// Has what a picker and a measurement ask of ChunkPoints, for its vertices.
export class ChunkMesh extends Mesh {
  constructor(material) {
    super(new BufferGeometry(), material);
    this.chunk = null;
    this.frame = []; // photos with their poses in the chunk's frame
    this.pickBase = 0; // the id of its first vertex while ids are drawn
    this.place = sim.identity(); // submap_from_frame
    this.matrixAutoUpdate = false;
  }

  // While ids are drawn, by another material.
  onBeforeRender() {
    const { uniforms } = this.material;
    if (!uniforms.uBase) return;
    uniforms.uBase.value = this.pickBase;
    this.material.uniformsNeedUpdate = true;
  }

  // The old buffers go only after the new ones are there.
  set(chunk) {
    const old = this.geometry;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(chunk.position, 4));
    geometry.setAttribute('colour', new BufferAttribute(chunk.colour, 4, true));
    geometry.setIndex(new BufferAttribute(chunk.index, 1));
    const half = new Vector3(32767.5, 32767.5, 32767.5);
    geometry.boundingSphere = new Sphere(half, half.length());
    this.geometry = geometry;
    this.chunk = chunk;
    this.setPlace(this.place);
    old.dispose();
  }

  // submap_from_frame
  setPlace(place) {
    this.place = place;
    this.matrix.copy(matrixOf(chunkPlace(place, this.chunk)));
    this.matrixWorldNeedsUpdate = true;
  }

  // Keeps about as many triangles.
  cut(triangles) {
    const coarse = coarsened(this.chunk, triangles);
    if (coarse !== this.chunk) this.set(coarse);
  }

  // Vertices that can be picked.
  get shown() {
    return this.chunk.vertices;
  }

  get numPoints() {
    return this.chunk.vertices;
  }

  // Of a vertex, in the submap's frame.
  own(index) {
    return sim.apply(this.place, pointOf(this.chunk, index));
  }

  // visit(x, y, z) of each vertex, in the submap's frame.
  each(visit) {
    const { elements: m } = this.matrix;
    const { position, vertices } = this.chunk;
    for (let i = 0; i < vertices; ++i) {
      const [x, y, z] = [position[4 * i], position[4 * i + 1], position[4 * i + 2]];
      visit(m[0] * x + m[4] * y + m[8] * z + m[12], m[1] * x + m[5] * y + m[9] * z + m[13], m[2] * x + m[6] * y + m[10] * z + m[14]);
    }
  }

  dispose() {
    this.geometry.dispose();
  }
}
