// Files out of a drop or a file field, as [{path, file}] with paths inside the dropped folder.

const JUNK = /(^|\/)(\.DS_Store|Thumbs\.db|desktop\.ini|__MACOSX(\/.*)?|\._[^/]*)$/;
const MESH = /\.(obj|ply|stl|glb|gltf|usd[acz]?)$/i;
const BESIDE = /\.(mtl|png|jpe?g|bin)$/i;
const MOUNT = /mount[^/]*\.json$/i;
const PLAIN = /^(session|recording|take|data)$/i;
const FILM = /\.(mp4|mov|m4v)$/i;
const PHOTO = /\.(jpe?g|png|heic|heif|webp|tiff?|dng)$/i;

/** @typedef {{path: string, file: File}} Placed a file, and its path inside what was dropped */
/** One thing that was dropped: a folder or a file by itself.
 *  @typedef {{name: string, folder: boolean, files: Placed[]}} Root */
/** What is sent as one thing. @typedef {{kind: string, name: string, files: Placed[]}} Order */

/** The roots of a drop. Must be called within the drop event: its list is emptied afterwards.
 *  @param {DataTransfer} transfer @returns {Promise<Root[]>} */
export function fromDrop(transfer) {
  const told = [...transfer.items].map((item) => item.webkitGetAsEntry?.() ?? null);
  const entries = told.filter((entry) => entry !== null);
  if (entries.length) return Promise.all(entries.map(root)).then(tidy);
  return Promise.resolve(tidy([...transfer.files].map(single)));
}

/** The roots of a file field, a folder's or that of single files.
 *  @param {HTMLInputElement} input @returns {Root[]} */
export function fromField(input) {
  const files = [...(input.files ?? [])];
  if (!files.some((file) => file.webkitRelativePath)) return tidy(files.map(single));
  /** @type {Map<string, Root>} */
  const roots = new Map();
  for (const file of files) {
    const [name, ...rest] = file.webkitRelativePath.split("/");
    const folder = roots.get(name) ?? { name, folder: true, files: [] };
    folder.files.push({ path: rest.join("/"), file });
    roots.set(name, folder);
  }
  return tidy([...roots.values()]);
}

/** What was dropped, by what it is: a recording, the mesh of an object, a mount file. Only what was
 *  dropped beside the recording's folder is taken for another thing: a session may hold meshes.
 *  @param {Root[]} roots @returns {Order[]} */
export function sorted(roots) {
  roots = roots.flatMap(parted);
  const loose = roots.filter((one) => !one.folder);
  const meshes = loose.filter((one) => MESH.test(one.name));
  const mounts = loose.filter((one) => MOUNT.test(one.name));
  const textures = meshes.length ? loose.filter((one) => BESIDE.test(one.name)) : [];
  const taken = new Set([...meshes, ...mounts, ...textures]);
  const rest = roots.filter((one) => !taken.has(one));
  const orders = [];
  if (rest.length) orders.push(order("session", rest));
  if (meshes.length) orders.push(order("object", [...meshes, ...textures]));
  for (const mount of mounts) orders.push(order("mount", [mount]));
  return orders;
}

/** What was dropped, if it is one thing: a film alone is no recording, nor are photos.
 *  @param {Root[]} roots @returns {"session" | "object" | "mount" | "video" | "material"} */
export function kindOf(roots) {
  const names = roots.flatMap((one) => one.files.map(({ path }) => path));
  if (names.length === 1 && FILM.test(names[0])) return "video";
  if (names.length > 1 && names.every((name) => PHOTO.test(name))) return "material";
  const kinds = sorted(roots).map(({ kind }) => kind);
  if (kinds.includes("session")) return "session";
  return kinds.includes("object") ? "object" : "mount";
}

/** A folder in which a recording's folder or archive lies beside its mount, as omocap simulate writes it,
 *  is as if each had been dropped by itself. @param {Root} one @returns {Root[]} */
function parted(one) {
  const beside = one.files.filter(({ path }) => !path.includes("/"));
  if (!one.folder || !beside.some(({ path }) => MOUNT.test(path))) return [one];
  /** @type {Map<string, Placed[]>} */
  const folders = new Map();
  for (const { path, file } of one.files) {
    const [folder, ...rest] = path.split("/");
    if (rest.length) folders.set(folder, [...(folders.get(folder) ?? []), { path: rest.join("/"), file }]);
  }
  if (folders.size > 1) return [one];
  // What a folder that says nothing is in is its name.
  const named = (/** @type {string} */ name) => (PLAIN.test(name) ? one.name : name);
  const inner = [...folders].map(([name, files]) => ({ name: named(name), folder: true, files }));
  return [...inner, ...beside.map(({ path, file }) => ({ name: path, folder: false, files: [{ path, file }] }))];
}

/** One order of one kind, whatever the files look like.
 *  @param {string} kind @param {Root[]} roots @returns {Order} */
export function order(kind, roots) {
  const alone = roots.length === 1 && roots[0].folder;
  const files = alone ? roots[0].files : roots.flatMap(within);
  return { kind, name: roots[0].name.replace(/\.(zip|tar|tgz|tar\.gz|r3d)$/i, ""), files };
}

/** @param {Root} one */
function within(one) {
  if (!one.folder) return one.files;
  return one.files.map(({ path, file }) => ({ path: `${one.name}/${path}`, file }));
}

/** @param {File} file @returns {Root} */
function single(file) {
  return { name: file.name, folder: false, files: [{ path: file.name, file }] };
}

/** @param {Root[]} roots */
function tidy(roots) {
  return roots
    .map((one) => ({ ...one, files: one.files.filter(({ path }) => !JUNK.test(path)) }))
    .filter((one) => one.files.length > 0);
}

/** @param {FileSystemEntry} entry @returns {Promise<Root>} */
async function root(entry) {
  if (isFolder(entry)) return { name: entry.name, folder: true, files: await walk(entry, "") };
  return single(await fileOf(entry));
}

/** @param {FileSystemDirectoryEntry} folder @param {string} prefix */
async function walk(folder, prefix) {
  /** @type {Placed[]} */
  const found = [];
  const reader = folder.createReader();
  // A reader gives at most a hundred entries at a time, and none when it is through.
  for (let some = await readSome(reader); some.length; some = await readSome(reader)) {
    for (const entry of some) {
      const path = `${prefix}${entry.name}`;
      if (isFolder(entry)) found.push(...(await walk(entry, `${path}/`)));
      else found.push({ path, file: await fileOf(entry) });
    }
  }
  return found;
}

/** @param {FileSystemEntry} entry @returns {entry is FileSystemDirectoryEntry} */
function isFolder(entry) {
  return entry.isDirectory;
}

/** @param {FileSystemDirectoryReader} reader @returns {Promise<FileSystemEntry[]>} */
function readSome(reader) {
  return new Promise((resolve, reject) => reader.readEntries(resolve, reject));
}

/** @param {FileSystemEntry} entry @returns {Promise<File>} */
function fileOf(entry) {
  const one = /** @type {FileSystemFileEntry} */ (entry);
  return new Promise((resolve, reject) => one.file(resolve, reject));
}
