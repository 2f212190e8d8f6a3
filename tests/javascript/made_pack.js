// A scene pack as docs/replay.md lays it out, written without the program that is tested.

const SIZES = { f4: 4, i2: 2, i1: 1, u1: 1, u2: 2, u4: 4 };
const WRITE = {
  f4: "setFloat32",
  i2: "setInt16",
  i1: "setInt8",
  u1: "setUint8",
  u2: "setUint16",
  u4: "setUint32",
};
const whole = (size) => 8 * Math.ceil(size / 8);

/** `arrays`: {name: {dtype, shape, values}}. */
export function packed(header, arrays) {
  const listed = {};
  let offset = 0;
  for (const [name, { dtype, shape, values }] of Object.entries(arrays)) {
    listed[name] = { dtype, shape, offset };
    offset += whole(values.length * SIZES[dtype]);
  }
  const text = new TextEncoder().encode(JSON.stringify({ version: 2, ...header, arrays: listed }));
  const first = whole(4 + text.length);
  const buffer = new ArrayBuffer(first + offset);
  const view = new DataView(buffer);
  view.setUint32(0, text.length, true);
  new Uint8Array(buffer).set(text, 4);
  for (const [name, { dtype, values }] of Object.entries(arrays)) {
    const start = first + listed[name].offset;
    values.forEach((value, k) => view[WRITE[dtype]](start + k * SIZES[dtype], value, true));
  }
  return buffer;
}

/** Headers have more than a test looks at. */
export const HEADER = {
  kind: "result",
  name: "made",
  fps: 10,
  frames: 3,
  samples: 1,
  chosen: 0,
  first: 0,
  joint_names: [],
  joint_parents: [],
  contacts: [[]],
  phone: null,
};
