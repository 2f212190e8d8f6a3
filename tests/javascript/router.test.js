import assert from "node:assert/strict";
import test from "node:test";

import { address, parse } from "../../capture_app/web/page/core/router.js";

const read = (hash) => {
  const { path, query } = parse(hash);
  return [path, Object.fromEntries(query)];
};

test("an address is a path and a query", () => {
  assert.deepEqual(read("#/results/00ff?compare=1"), ["/results/00ff", { compare: "1" }]);
  assert.deepEqual(read("#/library"), ["/library", {}]);
});

test("no address is the start", () => {
  for (const hash of ["", "#", "#?x=1"]) assert.equal(parse(hash).path, "/");
});

test("what has no value is left out of an address", () => {
  const query = { object: "a1", mount: null, back: "", from: undefined };
  assert.equal(address("/sessions/00ff", query), "#/sessions/00ff?object=a1");
  assert.equal(address("/library"), "#/library");
});

test("an address inside an address comes back whole", () => {
  const back = address("/sessions/00ff", { object: "a1", name: "100 % & more?" });
  assert.deepEqual(read(address("/scan", { back })), ["/scan", { back }]);
  assert.deepEqual(read(back)[1], { object: "a1", name: "100 % & more?" });
});
