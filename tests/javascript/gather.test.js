import assert from "node:assert/strict";
import test from "node:test";

import { fromDrop, fromField, kindOf, order, sorted } from "../../capture_app/web/page/upload/gather.js";

const file = (name, webkitRelativePath = "") => ({ name, webkitRelativePath });
const loose = (...names) => fromField({ files: names.map((name) => file(name)) });
const folder = (...paths) =>
  fromField({ files: paths.map((path) => file(path.split("/").at(-1), path)) });
const paths = (one) => one.files.map(({ path }) => path);
const told = (orders) => orders.map((one) => [one.kind, one.name, paths(one)]);

/** What a browser hands over for a dropped folder: it lists `batch` entries at a time. */
function dropped(name, children, batch = 2) {
  const rest = [...children];
  const readEntries = (done) => setTimeout(() => done(rest.splice(0, batch)));
  return { name, isDirectory: true, isFile: false, createReader: () => ({ readEntries }) };
}

const leaf = (name) => ({
  name,
  isDirectory: false,
  isFile: true,
  file: (done) => done(file(name)),
});
const drop = (...entries) => ({
  items: entries.map((entry) => ({ webkitGetAsEntry: () => entry })),
  files: [],
});

test("a chosen folder is one thing, with paths inside it", () => {
  const [one, ...others] = folder("take/odometry.csv", "take/depth/0.png");
  assert.deepEqual(
    [one.name, one.folder, paths(one)],
    ["take", true, ["odometry.csv", "depth/0.png"]],
  );
  assert.deepEqual(others, []);
});

test("chosen files are a thing each", () => {
  assert.deepEqual(
    loose("a.csv", "b.csv").map((one) => [one.name, one.folder]),
    [
      ["a.csv", false],
      ["b.csv", false],
    ],
  );
});

test("what systems leave lying about is not sent", () => {
  const junk = ["take/.DS_Store", "take/depth/Thumbs.db", "take/__MACOSX/x", "take/._odometry.csv"];
  const [one] = folder(...junk, "take/odometry.csv", "take/my.DS_Store.txt");
  assert.deepEqual(paths(one), ["odometry.csv", "my.DS_Store.txt"]);
  assert.deepEqual(loose("desktop.ini"), []);
});

test("a dropped folder is walked to its leaves, however many entries come at a time", async () => {
  const depth = dropped(
    "depth",
    ["0", "1", "2", "3", "4"].map((k) => leaf(`${k}.png`)),
  );
  const [one] = await fromDrop(
    drop(dropped("take", [leaf("odometry.csv"), depth, leaf(".DS_Store")])),
  );
  const pictures = ["0", "1", "2", "3", "4"].map((k) => `depth/${k}.png`);
  assert.deepEqual([one.name, paths(one)], ["take", ["odometry.csv", ...pictures]]);
});

test("dropped words are nothing; where a browser tells no entries, the files are taken", async () => {
  assert.deepEqual(await fromDrop(drop(null)), []);
  const [one] = await fromDrop({ items: [{}], files: [file("take.zip")] });
  assert.equal(one.name, "take.zip");
});

test("a recording, its object and its mount are told apart when dropped together", () => {
  const roots = [
    ...folder("take/odometry.csv"),
    ...loose("Chair.OBJ", "chair.mtl", "wood.jpg", "mount.json"),
  ];
  assert.deepEqual(told(sorted(roots)), [
    ["session", "take", ["odometry.csv"]],
    ["object", "Chair.OBJ", ["Chair.OBJ", "chair.mtl", "wood.jpg"]],
    ["mount", "mount.json", ["mount.json"]],
  ]);
});

test("a mesh inside a recording's folder belongs to the recording", () => {
  const [only, ...others] = sorted(folder("take/scan.obj", "take/odometry.csv"));
  assert.deepEqual([only.kind, others.length], ["session", 0]);
});

test("a folder with a recording, its mesh and its mount is understood whole", () => {
  const whole = ["session/odometry.csv", "session/rgb.mp4", "box.obj", "mount.json"];
  assert.deepEqual(told(sorted(folder(...whole.map((path) => `simulated/${path}`)))), [
    ["session", "simulated", ["odometry.csv", "rgb.mp4"]],
    ["object", "box.obj", ["box.obj"]],
    ["mount", "mount.json", ["mount.json"]],
  ]);
  const archive = folder("chair/take.r3d", "chair/chair.glb", "chair/mount.json");
  assert.deepEqual(sorted(archive).map(({ kind }) => kind), ["session", "object", "mount"]);
  // Without a mount nothing tells that the mesh is not the app's own.
  assert.deepEqual(sorted(folder("scan/frames/1.json", "scan/raw.glb")).map(({ kind }) => kind), ["session"]);
});

test("what was dropped is known by its names", () => {
  assert.equal(kindOf(loose("walk.MOV")), "video");
  assert.equal(kindOf(loose("1.jpg", "2.HEIC")), "material");
  assert.equal(kindOf(folder("photos/1.jpg", "photos/2.jpg")), "material");
  assert.equal(kindOf(folder("take/rgb.mp4", "take/odometry.csv")), "session");
  assert.equal(kindOf(loose("box.obj", "box.mtl", "box.png")), "object");
  assert.equal(kindOf(loose("mount.json")), "mount");
  assert.equal(kindOf(loose("take.zip")), "session");
});

test("pictures without a mesh are no object", () => {
  assert.deepEqual(
    sorted(loose("a.jpg")).map(({ kind }) => kind),
    ["session"],
  );
});

test("a single file is called without the ending of an archive", () => {
  const named = (name) => order("session", loose(name)).name;
  assert.deepEqual(["a.zip", "b.tar.gz", "c.tgz", "d.r3d", "e.csv"].map(named), [
    "a",
    "b",
    "c",
    "d",
    "e.csv",
  ]);
});

test("things of several folders keep apart under the folders' names", () => {
  const roots = [...folder("left/a.csv"), ...folder("right/a.csv")];
  assert.deepEqual(paths(order("session", roots)), ["left/a.csv", "right/a.csv"]);
});
