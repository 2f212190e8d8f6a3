// Reads a scene pack: a JSON header and plain arrays (capture_app/replay/layout.py).

const TYPES = {
  f4: Float32Array,
  i2: Int16Array,
  i1: Int8Array,
  u1: Uint8Array,
  u2: Uint16Array,
  u4: Uint32Array,
};

export function readPack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  if (header.version !== 1) throw new Error(`scene packs of version ${header.version} are not read`);
  const first = Math.ceil((4 + length) / 8) * 8;
  const views = new Map();
  const array = (name) => {
    const told = header.arrays[name];
    if (!told) return null;
    if (!views.has(name)) {
      const count = told.shape.reduce((a, b) => a * b, 1);
      views.set(name, new TYPES[told.dtype](buffer, first + told.offset, count));
    }
    return views.get(name);
  };
  return { header, array };
}
