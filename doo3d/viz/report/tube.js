"use strict";
// decoding of base64 numbers, and the tube of triangles around a chain

function bytes(text) {
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

/** Unpack points into columns: D arrays of N numbers. */
function unpack(packed) {
  const numbers = new DataView(bytes(packed.levels).buffer), dim = packed.center.length, count = numbers.byteLength / 2 / dim;
  return packed.center.map((center, k) => Float64Array.from({ length: count }, (_, i) => center + packed.step * numbers.getInt16(2 * (i * dim + k), true)));
}

/** Decode colors of five, six and five bits to CSS colors. */
function colors(text) {
  const numbers = new DataView(bytes(text).buffer);
  return Array.from({ length: numbers.byteLength / 2 }, (_, i) => {
    const value = numbers.getUint16(2 * i, true);
    const parts = [(value >> 11) / 31, ((value >> 5) & 63) / 63, (value & 31) / 31];
    return `rgb(${parts.map((part) => Math.round(255 * part)).join(",")})`;
  });
}

const add = (a, b, s) => a.map((value, k) => value + s * b[k]);
const dot = (a, b) => a.reduce((sum, value, k) => sum + value * b[k], 0);
const unit = (a) => { const size = Math.sqrt(dot(a, a)) || 1; return a.map((value) => value / size); };
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** How each kind of segment is drawn: seen, depth filled in, occluded, filled in from other frames. */
const kinds = [
  { text: "", opacity: 1, dash: "solid" },
  { text: "<br>depth filled in", opacity: 0.6, dash: "dot" },
  { text: "<br>occluded", opacity: 0.3, dash: "dash" },
  { text: "<br>from other frames", opacity: 0.45, dash: "longdashdot" },
];

/** Return the kind of each segment of a chain, as an index of `kinds`. */
function kindsOf(chain) {
  return [...chain.occluded].map((occluded, i) => occluded === "1" ? (chain.from_time?.[i] === "1" ? 3 : 2) : Number(chain.filled[i]));
}

/** Split segments into runs of one kind: [first joint, last joint, kind]. */
function kindRuns(numbers) {
  const runs = [];
  numbers.forEach((kind, i) => {
    if (!i || kind !== numbers[i - 1]) runs.push([i, i + 1, kind]);
    else runs[runs.length - 1][1] = i + 1;
  });
  return runs;
}

/** Build vertices and triangles of the tube through joints `first` to `last`; the cross-section is parallel-transported, so it does not twist. */
function tube(joints, radii, first, last, sides = 10) {
  const mesh = { x: [], y: [], z: [], i: [], j: [], k: [], joint: [] };
  let side = null;
  for (let n = first; n <= last; n++) {
    const joint = joints[n], before = joints[Math.max(n - 1, 0)], after = joints[Math.min(n + 1, joints.length - 1)];
    const tangent = unit(add(after, before, -1));
    if (side === null) side = Math.abs(tangent[0]) < 0.8 ? [1, 0, 0] : [0, 1, 0];
    side = unit(add(side, tangent, -dot(side, tangent)));
    const binormal = cross(tangent, side);
    for (let s = 0; s < sides; s++) {
      const angle = 2 * Math.PI * s / sides;
      const point = add(add(joint, side, radii[n] * Math.cos(angle)), binormal, radii[n] * Math.sin(angle));
      mesh.x.push(point[0]); mesh.y.push(point[1]); mesh.z.push(point[2]); mesh.joint.push(n);
      if (n < last) {
        const a = (n - first) * sides + s, b = (n - first) * sides + (s + 1) % sides;
        mesh.i.push(a, b); mesh.j.push(b, b + sides); mesh.k.push(a + sides, a + sides);
      }
    }
  }
  return mesh;
}
